#include "tests/net/fake_simulation.h"

namespace brachy::net::test {

Tissue line_tissue(std::uint32_t blocks) {
  constexpr std::uint32_t kBlock = 5;
  Tissue tissue;
  tissue.surface_count = kBlock;
  for (std::uint32_t i = 0; i < blocks * kBlock; ++i)
    tissue.rest_vertices.push_back(Vec3(i, 0.5 * i, -1.0 * i));
  tissue.triangles = {{0, 1, 2}};
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const std::uint32_t first = b * kBlock;
    tissue.blocks.push_back(
        {first, kBlock, tissue.rest_vertices[first], tissue.rest_vertices[first + kBlock - 1]});
  }
  return tissue;
}

FakeSimulation::FakeSimulation(const Tissue& tissue, std::uint32_t seed, std::size_t needles)
    : blocks_(tissue.blocks), random_(seed) {
  for (const Vec3& p : tissue.rest_vertices) {
    for (int axis = 0; axis < 3; ++axis) state_.mesh.deformed_vertices.push_back(static_cast<float>(p[axis]));
  }
  state_.mesh.block_ticks.resize(blocks_.size());
  state_.needles.states.resize(needles);
  state_.needles.pose_histories.resize(needles);
}

void FakeSimulation::step() {
  ++state_.summary.tick;
  state_.summary.sim_time_s = 0.005 * static_cast<double>(state_.summary.tick);
  std::uniform_real_distribution<float> coordinate(-50, 50);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    if (random_() % 8 != 0) continue;
    state_.mesh.block_ticks[b] = state_.summary.tick;
    for (std::size_t i = 0; i < 3 * std::size_t{blocks_[b].count}; ++i) {
      state_.mesh.deformed_vertices[3 * std::size_t{blocks_[b].first} + i] = coordinate(random_);
    }
  }
  for (std::size_t n = 0; n < state_.needles.states.size(); ++n) {
    NeedleState& needle = state_.needles.states[n];
    const auto number = static_cast<double>(n);
    needle.present = true;
    needle.X_WN.p.x() = static_cast<double>(state_.summary.tick) + 100 * number;
    needle.input.sequence = state_.summary.tick + 1000 * n;
    needle.input.received_ns = static_cast<std::int64_t>(state_.summary.tick + n);
    needle.forces.force_n = Vec3(0, 1, -number);
    state_.needles.pose_histories[n][state_.summary.tick % NeedleStates::kPoseHistory] = {state_.summary.tick,
                                                                                          needle.X_WN};
  }
}

}  // namespace brachy::net::test
