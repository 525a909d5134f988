#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "apps/brachy/files/image_files.h"
#include "apps/brachy/replay/load_motion.h"
#include "apps/command_line/tool.h"
#include "apps/recording/recorded_scanner.h"
#include "apps/terminal/progress.h"
#include "apps/terminal/set_up_progress.h"
#include "core/base/error.h"
#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_tissue.h"
#include "core/scene/load_ultrasound.h"
#include "core/simulation/simulator.h"
#include "haptics/devices/stepper.h"

namespace brachy {
namespace {

struct UsOptions {
  std::optional<std::filesystem::path> config;  ///< none: the built-in phantom
  std::optional<std::filesystem::path> trajectory;
  std::filesystem::path out;
  std::vector<std::string> arrays;  ///< none: the scene's
  std::vector<double> offsets_mm;   ///< none: the scene's
  double every_s = 0.1, from_s = 0;
  std::optional<double> until_s;
  std::string format = "png";
  bool planned_seeds = false;
  int threads = 0;
  bool json = false;
};

void make_directory(const std::filesystem::path& out) {
  std::error_code error;
  if (std::filesystem::exists(out, error) &&
      !(std::filesystem::is_directory(out, error) && std::filesystem::is_empty(out, error) && !error))
    throw UserError(out.string() + ": exists and is not an empty directory; give another --out");
  std::filesystem::create_directories(out, error);
  if (error) throw UserError(out.string() + ": cannot be made (" + error.message() + "); give another --out");
}

Scene scene_of(const UsOptions& options) {
  Scene scene = options.config ? load_scene(*options.config) : Scene{};
  if (options.threads) scene.engine.threads = options.threads;
  return with_choice(scene, nullptr);
}

// Those at the start and the plan's, as if a session had left each in its place.
std::vector<Seed> seeds_with_plan(const Scene& scene) {
  const std::optional<Plan> plan = load_plan(scene);
  if (!plan) throw UserError("--planned-seeds: the scene has no plan; give it plan.file");
  std::vector<Seed> seeds = load_seeds_at_start(scene);
  std::int32_t number = 0;
  for (const PlannedSeed& planned : plan->seeds(scene.template_grid)) {
    Seed& seed = seeds.emplace_back();
    seed.id = static_cast<std::uint32_t>(seeds.size());
    seed.planned = number++;
    seed.rest = seed.dropped = seed.position = planned.position;
    seed.rest_axis = seed.dropped_axis = seed.axis = planned.axis;
    seed.source = planned.source;
    seed.air_kerma_strength_u = planned.air_kerma_strength_u;
  }
  return seeds;
}

struct View {
  std::string name;
  RigidTransform X_WP;  ///< while the probe has no pose
  double offset_mm;
  std::unique_ptr<UltrasoundImager> imager;
};

/// The scanner's views: every array at every offset.
std::vector<View> views_of(const UsOptions& options, const Scene& scene, const Tissue& tissue,
                           const std::shared_ptr<const EchoMap>& echoes) {
  std::vector<View> views;
  const auto arrays = options.arrays.empty() ? std::vector{scene.ultrasound.array} : options.arrays;
  const auto offsets =
      options.offsets_mm.empty() ? std::vector{scene.ultrasound.offset_mm} : options.offsets_mm;
  for (const std::string& array : arrays)
    for (const double offset : offsets) {
      Scene of_view = scene;
      of_view.ultrasound.array = array;
      of_view.ultrasound.offset_mm = offset;
      const std::string name = offsets.size() > 1 ? fmt::format("{}_{:+g}mm", array, offset) : array;
      views.push_back({name, resting_probe(of_view, tissue), offset,
                       std::make_unique<UltrasoundImager>(imager_options(of_view), echoes)});
    }
  return views;
}

/// The settings of a recorded session, which change what is not given on the command line.
class RecordedConsole {
 public:
  RecordedConsole(const UsOptions& options, double period_s) : period_s_(period_s) {
    if (options.trajectory && is_recording_file(*options.trajectory))
      settings_ = load_recorded_scanner(*options.trajectory);
  }

  /// Takes what was set until `at_s`. Whether there was something new: the views are to be made again.
  bool advance(double at_s, UsOptions& options, Scene& scene) {
    bool is_new = false;
    for (; next_ < settings_.size() &&
           (next_ == 0 || period_s_ * static_cast<double>(settings_[next_].tick) <= at_s + 0.5 * period_s_);
         ++next_) {
      const net::ScannerMessage& s = settings_[next_];
      UltrasoundSettings& u = scene.ultrasound;
      const UltrasoundSettings before = u;
      const std::vector<std::string> arrays_before = options.arrays;
      u.depth_mm = s.depth_mm;
      u.gain_db = s.gain_db;
      u.dynamic_range_db = s.dynamic_range_db;
      u.tgc_extra_db_per_cm = s.tgc_extra_db_per_cm;
      u.focus_mm = s.focus_mm;
      options.arrays = s.array == net::ScannerArray::kBiplane
                           ? std::vector<std::string>{"transverse", "sagittal"}
                       : s.array == net::ScannerArray::kSagittal ? std::vector<std::string>{"sagittal"}
                       : s.array == net::ScannerArray::kEndFire  ? std::vector<std::string>{"end_fire"}
                                                                 : std::vector<std::string>{"transverse"};
      target_ = {s.probe_depth_mm, s.probe_rotation_deg};
      if (next_ == 0) stepper_.move(target_, INFINITY);  // where it was when the recording began
      is_new |= !(before == u) || options.arrays != arrays_before;
    }
    stepper_.move(target_, period_s_);
    return is_new;
  }
  /// Of a probe without a pose, which rests at X_WR.
  RigidTransform probe(const RigidTransform& X_WR) const { return stepper_.pose(X_WR); }

 private:
  double period_s_;
  std::vector<net::ScannerMessage> settings_;
  std::size_t next_ = 0;
  StepperPlace target_;
  Stepper stepper_;
};

int run(const UsOptions& given) {
  UsOptions options = given;  // a recording may change the arrays
  Scene scene = scene_of(options);
  std::optional<NeedleTrajectories> trajectories;
  if (options.trajectory)
    trajectories = load_motion(*options.trajectory, ReplayedModel::kRecorded, scene.instrument_count());
  Simulator simulator(load_simulation_model(scene, load_tissue(scene).tissue, announced_set_up()));
  if (options.planned_seeds) simulator.restore_seeds(seeds_with_plan(scene));
  const auto echoes = load_echo_map(scene, load_structures(scene));
  std::vector<View> views = views_of(options, scene, simulator.tissue(), echoes);
  RecordedConsole console(options, simulator.period_s());
  make_directory(options.out);

  MeshState state = simulator.initial_state();
  std::vector<NeedlePose> poses(scene.instrument_count());
  const double period_s = simulator.period_s(), duration_s = trajectories ? trajectories->duration_s() : 0;
  const double until_s = std::min(options.until_s.value_or(duration_s), duration_s);
  const auto ticks = static_cast<std::uint64_t>(std::floor(until_s / period_s + 1e-6)) + 1;
  const double every = std::max(1.0, std::round(options.every_s / period_s));
  std::size_t images = 0, held = 0;
  double worst_mm = 0;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  Progress progress("us");
  for (std::uint64_t k = 0; k < ticks; ++k) {
    progress.show_step(k, ticks);
    const double t_s = static_cast<double>(k) * period_s;
    const double at_s = trajectories ? trajectories->start_s() + t_s : 0;
    if (trajectories)
      for (const auto& needle : trajectories->needles()) {
        NeedlePose& pose = poses[needle.id];
        const auto X_WN = trajectories->sample(needle.id, at_s);
        pose.present = X_WN.has_value();
        if (!X_WN) continue;
        pose.X_WN = *X_WN;
        pose.button = trajectories->button(needle.id, k == 0 ? -INFINITY : at_s - period_s, at_s);
        ++pose.sequence;
      }
    simulator.step(poses, state);
    if (console.advance(at_s, options, scene)) {
      if (!given.arrays.empty()) options.arrays = given.arrays;
      views = views_of(options, scene, simulator.tissue(), echoes);
    }
    if (t_s < options.from_s || std::fmod(static_cast<double>(k), every) != 0) continue;
    for (const View& view : views) {
      const std::span<const NeedleState> needles = state.needles.states;
      RigidTransform X_WP = console.probe(view.X_WP);
      if (scene.probe.on && needles.back().present) {
        X_WP = needles.back().X_WN;
        if (!options.offsets_mm.empty()) X_WP.p += view.offset_mm * X_WP.R.col(2);
      }
      const ImageResult result = view.imager->render(
          {simulator.field(), simulator.body_frame(), state.summary.certificate.verdict, state.summary.tick,
           needles.first(scene.needle.count), state.seeds.in_tissue(), X_WP});
      const bool is_new = result == ImageResult::kNew;
      held += !is_new;
      worst_mm = std::max(worst_mm, is_new ? view.imager->inverse().worst_residual_mm() : 0);
      const std::string stem = fmt::format("{}_{:06d}", view.name, k);
      const ImagePlane& plane = view.imager->plane();
      const GrayImage image{plane.width(), plane.height(), view.imager->pixels()};
      if (options.format != "nrrd") write_png(options.out / (stem + ".png"), image);
      if (options.format != "png")
        write_nrrd(options.out / (stem + ".nrrd"), image, view.imager->image_pose(), plane.spacing_mm(),
                   scene.ultrasound.elevation_mm);
      list.push_back({{"name", stem}, {"t_s", t_s}, {"tick", state.summary.tick}, {"is_new", is_new}});
      ++images;
    }
  }
  progress.finish();
  if (options.json) {
    const nlohmann::ordered_json json = {{"out", options.out.string()},
                                         {"images", images},
                                         {"held", held},
                                         {"width_px", scene.ultrasound.width_px},
                                         {"height_px", scene.ultrasound.height_px},
                                         {"spacing_mm", views.front().imager->plane().spacing_mm()},
                                         {"worst_residual_mm", worst_mm},
                                         {"seeds", state.seeds.count},
                                         {"files", list}};
    std::cout << json.dump() << "\n";
  } else {
    std::cout << fmt::format(
        "{}: {} images, {} of them held because their field folds or could not be inverted\n",
        options.out.string(), images, held);
  }
  return kExitOk;
}

void declare(OptionList& list, UsOptions& options) {
  list.add("--config", options.config, "scene; default: the built-in phantom");
  list.add("--trajectory", options.trajectory,
           "CSV or recording of the needles (and the probe after them); default: one image at rest");
  list.add_output_folder("--out", options.out, "directory to write; must not exist yet, or be empty")
      .required();
  list.add("--arrays", options.arrays, "transverse, sagittal, end_fire; default: the scene's")
      .comma_separated();
  list.add("--offsets-mm", options.offsets_mm,
           "the probe stepped along its axis to each; default: the scene's")
      .comma_separated()
      .range(-200, 200);
  list.add("--every-s", options.every_s, "time between images").range(0.001, 1e4).show_default();
  list.add("--from-s", options.from_s, "time of the first").range(0.0, 1e6).show_default();
  list.add("--until-s", options.until_s, "end; default: the trajectory's").range(0.0, 1e6);
  list.add("--format", options.format, "of the files").one_of({"png", "nrrd", "both"}).show_default();
  list.add_flag("--planned-seeds", options.planned_seeds, "the plan's seeds are in the gland from the start");
  list.add("--threads", options.threads, "OpenMP threads; default: the scene's").range(1, 64);
  list.add_flag("--json", options.json, "print the result as JSON");
}

}  // namespace

Tool us_tool() {
  return make_tool<UsOptions>("us", "Make ultrasound images of a trajectory, offline.", R"(Examples:
  brachy us --config config/prostate.toml --out rest
  brachy us --trajectory config/insertion.csv --arrays transverse,sagittal --every-s 0.0333 --out biplane
  brachy us --config config/session.toml --planned-seeds --offsets-mm=-20,-15,-10,-5,0,5,10,15,20 --out volume
  brachy us --config scene.toml --trajectory run.csv --format nrrd --out nrrd      in place in 3D Slicer
Files are ARRAY[_OFFSETmm]_TICK.png, 8-bit gray, and .nrrd, one slice with its place in RAS. The scanner is the
scene's table [ultrasound]. With [probe] on and a pose in the trajectory the image is the probe's; otherwise the
probe lies behind the gland. Where a tick's field is not certified the last image stands, and "is_new" is false.
The same scene and trajectory give the same files, for any number of threads. A recording also has what was set at the
console of a live scanner, tick by tick: arrays, depth, gain and the probe's stepper are then its.
Exit codes: 0 done, 2 bad input.)",
                              declare, run);
}

}  // namespace brachy
