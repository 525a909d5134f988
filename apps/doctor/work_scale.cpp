#include "apps/doctor/work_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <memory>

#include "core/realtime/deadline.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"

namespace brachy {
namespace {

constexpr int kTicks = 200, kRuns = 6;
/// Processor time of `push_needles` with AVX-512 on the machine of core/DESIGN.md, section 7, s.
constexpr double kStoredSeconds = 0.5;

/// Four needles go into the gland side by side, to four fifths of its depth. Returns the processor time, s.
double push_needles(const std::shared_ptr<const SimulationModel>& model) {
  constexpr double kDepth = 0.8, kBesideMm = 4;
  Simulator simulator(model);
  MeshState state = simulator.initial_state();
  const auto [low, high] = std::ranges::minmax(model->tissue.rest_vertices,
                                               [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  std::array<NeedlePose, 4> needles;
  const std::int64_t begin_ns = thread_cpu_ns();
  for (int tick = 0; tick < kTicks; ++tick) {
    const double z = low.z() + kDepth * (high.z() - low.z()) * tick / kTicks;
    for (std::size_t n = 0; n < needles.size(); ++n) {
      needles[n].present = true;
      needles[n].X_WN.p = Vec3(n % 2 ? kBesideMm : -kBesideMm, n / 2 ? kBesideMm : -kBesideMm, z);
    }
    simulator.step(needles, state);
  }
  return 1e-9 * static_cast<double>(thread_cpu_ns() - begin_ns);
}

}  // namespace

double measure_work_scale(const Scene& scene) {
  Scene fixed;
  fixed.needle.count = 4;
  fixed.engine.simd = scene.engine.simd;
  const auto model = load_simulation_model(fixed, load_tissue(fixed).tissue);
  double least_s = std::numeric_limits<double>::infinity();
  for (int run = 0; run < kRuns; ++run) least_s = std::min(least_s, push_needles(model));
  return least_s / kStoredSeconds;
}

std::string work_costs_toml(const WorkCosts& costs, const std::string& indent) {
  return fmt::format(
      "{0}[work_costs]\n{0}system_s = {1:.3g}\n{0}landmark_s = {2:.3g}\n{0}landmark_pair_s = {3:.3g}\n"
      "{0}step_s = {4:.3g}\n{0}certificate_pair_s = {5:.3g}\n{0}block_ring_steps_per_s = {6:.3g}\n",
      indent, costs.system_s, costs.landmark_s, costs.landmark_pair_s, costs.step_s, costs.certificate_pair_s,
      costs.block_ring_steps_per_s);
}

}  // namespace brachy
