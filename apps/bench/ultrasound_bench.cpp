// An ultrasound image of the default scene with three needles and 75 seeds, one thread, the needles moving from image
// to image: one array, both, larger images and more elevational planes. The baseline is the same image at rest.
#include <memory>
#include <random>

#include "apps/bench/benches.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"
#include "core/realtime/deadline.h"
#include "core/realtime/histogram.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_tissue.h"
#include "core/scene/load_ultrasound.h"
#include "core/simulation/simulator.h"

namespace brachy::bench {
namespace {

constexpr std::size_t kShownSeeds = 75;
constexpr int kTicksAnImage = 6;

struct Variant {
  const char* name;
  std::vector<std::string> arrays;
  int pixels, planes;
};

class Examination {
 public:
  Examination(const Variant& variant, SimdTarget target, bool at_rest)
      : scene_(scene(target)),
        simulator_(load_simulation_model(scene_, load_tissue(scene_).tissue)),
        poses_(scene_.needle.count) {
    const auto echoes = load_echo_map(scene_, load_structures(scene_));
    for (const std::string& array : variant.arrays) {
      UltrasoundImager::Options options = imager_options(scene_);
      options.settings.array = array;
      options.settings.width_px = options.settings.height_px = variant.pixels;
      options.settings.planes = variant.planes;
      options.keeps_solution = true;
      imagers_.push_back(std::make_unique<UltrasoundImager>(options, echoes));
    }
    if (at_rest) {
      state_ = simulator_.initial_state();
      return;
    }
    std::mt19937 random(1);
    std::uniform_real_distribution<double> in(-1, 1);
    std::vector<Seed> seeds(kShownSeeds);
    for (std::size_t k = 0; k < kShownSeeds; ++k) {
      seeds[k].id = static_cast<std::uint32_t>(k + 1);
      const double x = 17 * in(random), y = 12 * in(random);
      seeds[k].rest = seeds[k].position = Vec3(x, y, 16 * in(random));
    }
    simulator_.restore_seeds(seeds);
    state_ = simulator_.initial_state();
    for (double z = -40; z < 12; z += 0.4) step_at(z);
  }
  void advance() {
    if (!poses_[0].present) return;
    // Six ticks of 200 Hz for each image at 30 Hz, to and fro at 3 cm/s; and more until an image can be made: one that
    // is held takes no time, which is not what is timed.
    for (int k = 0; k < kTicksAnImage; ++k) step();
    while (state_.summary.certificate.verdict != Verdict::kInjective) {
      ++held_;
      step();
    }
  }
  void render() {
    const std::int64_t start = thread_cpu_ns();
    for (auto& imager : imagers_)
      held_ +=
          imager->render({simulator_.field(), simulator_.body_frame(), state_.summary.certificate.verdict,
                          state_.summary.tick, state_.needles.states, state_.seeds.in_tissue(),
                          resting_probe(scene_, simulator_.tissue())}) != ImageResult::kNew;
    times_.record(thread_cpu_ns() - start);
  }
  const Histogram& times() const { return times_; }
  std::size_t held() const { return held_; }

 private:
  static Scene scene(SimdTarget target) {
    Scene scene;
    scene.needle.count = 3;
    scene.engine.simd = to_string(target);
    return scene;
  }
  void step() {
    z_ += way_;
    if (z_ > 15 || z_ < 9) way_ = -way_;
    step_at(z_);
  }
  void step_at(double z) { step_needles(simulator_, poses_, z, state_); }

  Scene scene_;
  Simulator simulator_;
  MeshState state_;
  std::vector<NeedlePose> poses_;
  std::vector<std::unique_ptr<UltrasoundImager>> imagers_;
  double z_ = 12, way_ = 0.15;
  std::size_t held_ = 0;
  Histogram times_;
};

void run_ultrasound(benchmark::State& state, Report& report, SimdTarget target, Row row,
                    const Variant& variant) {
  Examination busy(variant, target, false), rest(variant, target, true);
  time_row(state, row, {[&] { busy.render(); }, [&] { busy.advance(); }}, {[&] { rest.render(); }, [] {}});
  const auto ms = [](std::int64_t ns) { return 1e-6 * static_cast<double>(ns); };
  row.more["p50_ms"] = ms(busy.times().quantile(0.5));
  row.more["p99_ms"] = ms(busy.times().quantile(0.99));
  row.more["images"] = static_cast<double>(busy.times().count());
  row.more["held"] = static_cast<double>(busy.held());
  for (const char* name : {"p50_ms", "p99_ms", "images", "held"}) state.counters[name] = row.more[name];
  report.rows.push_back(row);
}

}  // namespace

void add_ultrasound_benches(Report& report, const BenchOptions& options) {
  static const std::vector<Variant> variants = {
      {"512", {"transverse"}, 512, 3},         {"512_biplane", {"transverse", "sagittal"}, 512, 3},
      {"512_1_plane", {"transverse"}, 512, 1}, {"512_5_planes", {"transverse"}, 512, 5},
      {"1024", {"transverse"}, 1024, 3},       {"1024_5_planes", {"transverse"}, 1024, 5}};
  for (const Variant& variant : variants) {
    const Row row{.name = std::string("ultrasound_") + variant.name,
                  .kernel = "elastic",
                  .points = Scene{}.tissue.points};
    const auto target = options.target;
    add_benchmark(report, name_of(row), [&report, target, row, &variant](benchmark::State& state) {
      run_ultrasound(state, report, target, row, variant);
    });
  }
}

}  // namespace brachy::bench
