#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/place_trajectory.h"
#include "apps/brachy/tools.h"
#include "apps/certificate_report.h"
#include "apps/tissue_box.h"
#include "core/choice/choice.h"
#include "core/scene/load_tissue.h"
#include "core/scene/scene_file.h"
#include "core/sim/simulator.h"
#include "core/sim/state_hash.h"

namespace brachy {

int replay_offline(const ReplayOptions& options) {
  Trajectory trajectory = load_trajectory(options.trajectory);
  Scene scene = options.config ? load_scene(*options.config) : Scene{};
  if (options.threads) scene.engine.threads = options.threads;
  if (!options.simd.empty()) scene.engine.simd = options.simd;
  std::string choice;
  scene = with_choice(scene, &choice);
  if (!choice.empty()) std::cerr << "brachy: " << choice << "\n";
  Simulator simulator(scene, load_tissue(scene).tissue);
  trajectory =
      place(std::move(trajectory), options, options.centre_on_tissue || scene.device.centre_on_tissue,
            centre_of(simulator.tissue()));

  // One tick for each period from the first sample to the last, as the recorder's pose log counts them.
  const double period_s = simulator.period_s();
  const auto ticks = static_cast<std::uint64_t>(std::floor(trajectory.duration_s() / period_s + 1e-6)) + 1;
  MeshState state = simulator.initial_state();
  NeedlePose pose;
  pose.present = true;
  StateHash hash;
  CertificateTally certificates;
  double max_displacement = 0, max_depth = 0;
  std::uint32_t max_moved = 0, all_flags = 0;
  std::uint64_t in_contact = 0;
  for (std::uint64_t k = 0; k < ticks; ++k) {
    pose.X_WN = trajectory.sample(trajectory.start_s() + static_cast<double>(k) * period_s);
    pose.sequence = k + 1;
    simulator.step(pose, state);
    hash.add(state);
    certificates.add(state.certificate, state.step_flags,
                     changes_are_finite(state, simulator.tissue().blocks));
    max_displacement = std::max(max_displacement, state.max_displacement_mm);
    max_depth = std::max(max_depth, state.needles[0].insertion_depth_mm);
    max_moved = std::max(max_moved, state.moved_vertices);
    all_flags |= state.step_flags;
    in_contact += state.landmark_count > 0;
  }

  const auto& evaluations = simulator.evaluation_counts();
  const auto ticks_of = [&](Evaluation e) { return evaluations[static_cast<std::size_t>(e)]; };
  const std::string state_hash = fmt::format("{:016x}", hash.value());
  if (options.json) {
    nlohmann::ordered_json json = {
        {"ticks", ticks},
        {"state_hash", state_hash},
        {"points", simulator.tissue().size()},
        {"max_disp_mm", max_displacement},
        {"max_depth_mm", max_depth},
        {"moved", max_moved},
        {"ticks_in_contact", in_contact},
        {"punctures", state.needles[0].puncture_count},
        {"contact", to_string(state.needles[0].contact)},
        {"simd", to_string(simulator.simd_target())},
        {"ticks_idle", ticks_of(Evaluation::kIdle)},
        {"ticks_direct", ticks_of(Evaluation::kDirect)},
        {"ticks_mixed", ticks_of(Evaluation::kMixed)},
        {"ticks_condensed", ticks_of(Evaluation::kCondensed)},
        {"solve_failed", (all_flags & kStepSolveFailed) != 0},
        {"saturated", (all_flags & kStepSaturated) != 0},
        {"reseated", (all_flags & kStepReseated) != 0},
    };
    add_to_json(json, "ticks", certificates);
    std::cout << json.dump() << "\n";
  } else {
    std::cout << fmt::format(
        "{} ticks of {} points, {} in contact, {} punctures, ends {}\n"
        "largest displacement {:.3f} mm, deepest insertion {:.1f} mm, at most {} points moved{}{}{}\n"
        "fields: {} idle, {} direct, {} mixed, {} condensed, on {}\n"
        "{}state hash {}\n",
        ticks, simulator.tissue().size(), in_contact, state.needles[0].puncture_count,
        to_string(state.needles[0].contact), max_displacement, max_depth, max_moved,
        all_flags & kStepSolveFailed ? "; a solve FAILED" : "",
        all_flags & kStepSaturated ? "; a landmark was held at its limit" : "",
        all_flags & kStepReseated ? "; the needle jumped" : "", ticks_of(Evaluation::kIdle),
        ticks_of(Evaluation::kDirect), ticks_of(Evaluation::kMixed), ticks_of(Evaluation::kCondensed),
        to_string(simulator.simd_target()), to_text("ticks", certificates), state_hash);
  }
  return kExitOk;
}

}  // namespace brachy
