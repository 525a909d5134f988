#pragma once

#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "core/geometry/tissue/tissue.h"
#include "core/simulation/mesh_state.h"

namespace brachy::net::test {

/// `blocks` blocks of 5 points on a line; a triangle as the surface.
Tissue line_tissue(std::uint32_t blocks);

/// Stands in for the simulator: moves the points of random blocks and every needle, one tick at a time.
class FakeSimulation {
 public:
  explicit FakeSimulation(const Tissue& tissue, std::uint32_t seed = 1, std::size_t needles = 1);
  void step();
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }
  std::shared_ptr<const MeshState> snapshot() const { return std::make_shared<const MeshState>(state_); }
  const MeshState& state() const { return state_; }
  MeshState& state() { return state_; }

 private:
  std::vector<Block> blocks_;
  MeshState state_;
  std::mt19937 random_;
};

}  // namespace brachy::net::test
