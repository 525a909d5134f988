#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <optional>
#include <utility>

#include "apps/brachy/replay/load_motion.h"
#include "apps/brachy/replay/place_trajectory.h"
#include "apps/brachy/replay/replay.h"
#include "apps/brachy/replay/replay_report.h"
#include "apps/brachy/replay/simulated_device.h"
#include "apps/command_line/exit_code.h"
#include "apps/reports/tissue_box.h"
#include "apps/score/hdr_report.h"
#include "apps/score/report.h"
#include "apps/session/session_log.h"
#include "apps/session/session_manifest.h"
#include "apps/session/session_states.h"
#include "apps/terminal/progress.h"
#include "apps/terminal/set_up_progress.h"
#include "core/base/error.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/scene/choice/choice.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/delivered_catheters.h"
#include "core/simulation/state_hash.h"

namespace brachy {
namespace {

/// As it is simulated.
Scene prepared(Scene scene, const ReplayOptions& options) {
  if (options.threads) scene.engine.threads = options.threads;
  if (!options.simd.empty()) scene.engine.simd = options.simd;
  std::string choice;
  scene = with_choice(scene, &choice);
  if (!choice.empty()) std::cerr << "brachy: " << choice << "\n";
  return scene;
}

std::vector<std::uint32_t> ids_of(const NeedleTrajectories& trajectories) {
  std::vector<std::uint32_t> ids;
  for (const auto& needle : trajectories.needles()) ids.push_back(needle.id);
  return ids;
}

void add_to_log(ForceLogWriter& log, double t_s, const MeshState& state) {
  const std::vector<NeedleState>& needles = state.needles.states;
  for (std::uint32_t id = 0; id < needles.size(); ++id)
    if (needles[id].present)
      log.add(force_sample(t_s, id, needles[id], state.summary.certificate.vertex_det));
}

/// Of the session that is computed: without times, so that the same bytes come twice.
SessionManifest manifest_for(const ReplayOptions& options, const SessionScene& of_session,
                             const Scene& scene) {
  SessionManifest manifest;
  if (of_session.manifest) manifest = *of_session.manifest;
  if (!of_session.manifest || options.config) {
    const SessionManifest played = std::exchange(manifest, make_manifest(scene, options.config));
    manifest.trainee = played.trainee;
    manifest.exercise = played.exercise;
  }
  manifest.runs.clear();
  if (!options.trainee.empty()) manifest.trainee = options.trainee;
  return manifest;
}

/// Restores what the trajectory's session kept before `from_s`; returns the first tick after it.
std::uint64_t restore_before(double from_s, const ReplayOptions& options, double start_s,
                             Simulator& simulator) {
  const std::filesystem::path folder =
      options.trajectory.has_parent_path() ? options.trajectory.parent_path() : std::filesystem::path(".");
  const SessionState state = load_session_state(SessionFolder::open(folder), from_s);
  try {
    simulator.restore(state.bytes);
  } catch (const UserError& e) {
    throw UserError(fmt::format("{}: the state at {} s: {}; give the session's own --config", folder.string(),
                                state.t_s, e.what()));
  }
  std::cerr << fmt::format("brachy: goes on from {} s\n", state.t_s);
  return static_cast<std::uint64_t>(
      std::max(0.0, std::round((state.t_s - start_s) / simulator.period_s()) + 1));
}

}  // namespace

int replay_offline(const ReplayOptions& options) {
  const SessionScene of_session = load_scene_for(options.trajectory, options.config, options.what_if);
  const Scene scene = prepared(of_session.scene, options);
  NeedleTrajectories trajectories =
      load_motion(options.trajectory, ReplayedModel::kRecorded, scene.instrument_count());
  Simulator simulator(load_simulation_model(scene, load_tissue(scene).tissue, announced_set_up()));
  trajectories = place(trajectories, options, options.centre_on_tissue || scene.device.centre_on_tissue,
                       centre_of(simulator.tissue()));
  std::optional<ForceLogWriter> log;
  if (options.log) log.emplace(*options.log, options.force ? RowFile::Start::kAnew : RowFile::Start::kNew);
  std::optional<SessionLog> session;
  if (options.session) {
    if (SessionLog::is_recording(*options.session))
      throw UserError(options.session->string() + ": already holds a recording; give another directory");
    session.emplace(*options.session, scene.instrument_count(), simulator.period_s(),
                    names_of(simulator.model()->organs));
    session->folder().replace(kManifestFile, to_json(manifest_for(options, of_session, scene)));
  }

  // One tick for each period from the first sample to the last, as the recorder's pose log counts them.
  const double period_s = simulator.period_s();
  const auto ticks = static_cast<std::uint64_t>(std::floor(trajectories.duration_s() / period_s + 1e-6)) + 1;
  std::uint64_t k =
      options.from_s ? restore_before(*options.from_s, options, trajectories.start_s(), simulator) : 0;
  MeshState state = simulator.initial_state();
  std::vector<NeedlePose> poses(trajectories.id_count());
  StateHash hash;
  ReplayTally tally(ids_of(trajectories));
  std::vector<std::byte> saved;
  Progress progress("replay");
  const auto tick = [&](const NeedlePose* held) {
    progress.show_step(k, ticks);
    const auto time_of = [&](std::uint64_t i) {
      return trajectories.start_s() + static_cast<double>(i) * period_s;
    };
    const double t_s = time_of(k), last_s = k == 0 ? -INFINITY : time_of(k - 1);
    ++k;
    for (const auto& needle : trajectories.needles()) {
      const auto X_WN = trajectories.sample(needle.id, t_s);
      NeedlePose& pose = poses[needle.id];
      pose.present = X_WN.has_value();
      if (!X_WN) continue;
      pose.X_WN = *X_WN;
      pose.button = trajectories.button(needle.id, last_s, t_s);
      ++pose.sequence;
    }
    const std::uint32_t held_id = trajectories.needles().front().id;
    if (held) {
      // the trajectory's: only the motion passes through the device
      const bool button = poses[held_id].button;
      poses[held_id] = *held;
      poses[held_id].button = button;
    }
    simulator.step(poses, state);
    hash.add(state);
    tally.add(t_s, state, changes_are_finite(state, simulator.tissue().blocks));
    if (log) add_to_log(*log, t_s, state);
    if (session) session->add(state);
    if (session && state.summary.tick % ticks_per_state(period_s) == 0) {
      simulator.save(saved);
      session->add_state(state.summary.tick, saved);
    }
    return state.needles.states[held_id].local_model;
  };
  HandReport hand;
  if (options.device)
    hand = hold(*options.device, trajectories.needles().front().motion, period_s, ticks,
                [&](const NeedlePose& pose) { return tick(&pose); });
  else
    while (k < ticks) tick(nullptr);

  progress.finish();

  // The result is printed first: a full disk then costs only the end of the log.
  const std::string state_hash = fmt::format("{:016x}", hash.value());
  if (options.json)
    std::cout << with_hand(tally.to_json(simulator, state_hash), options.device, hand);
  else
    std::cout << tally.to_text(simulator, state_hash) << to_text(options.device, hand);
  std::cout << std::flush;
  if (log) log->close();
  if (session) session->close();
  if (session && scene.implant.is_hdr()) {
    const std::optional<HdrPlan> plan = load_hdr_plan(scene);
    session->folder().replace(kCatheterFile,
                              to_csv(delivered_catheters(simulator, state, plan ? &*plan : nullptr)));
    if (!plan) return kExitOk;
    const FractionReport report = make_fraction_report(*options.session, *plan, scene);
    keep_report(session->folder(), report, EarlierReport::kRefused);
    if (!options.json)
      std::cout << to_text(report) << session->folder().path_of(kReportPage).string() << "\n";
    return kExitOk;
  }
  const std::optional<Plan> plan = session ? load_plan(scene) : std::nullopt;
  if (!plan) return kExitOk;
  const Report report = make_report(*options.session, *plan, scene);
  keep_report(session->folder(), report, EarlierReport::kRefused);
  if (!options.json)
    std::cout << to_text(report.score) << session->folder().path_of(kReportPage).string() << "\n";
  return kExitOk;
}

}  // namespace brachy
