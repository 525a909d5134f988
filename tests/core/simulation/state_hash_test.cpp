#include "core/simulation/state_hash.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <vector>

namespace brachy {
namespace {

/// The rule of net/PROTOCOL.md ("State hash"), over a tick's words.
std::uint64_t documented_hash(const std::vector<std::uint64_t>& words) {
  std::uint64_t h = 0xcbf29ce484222325;
  for (const std::uint64_t w : words) {
    h = (h ^ w) * 0x100000001b3;
    h ^= h >> 29;
  }
  return h;
}

TEST(StateHash, IsThatOfTheDocumentsWordsInTheirOrder) {
  MeshState state;
  state.summary.tick = 7;
  state.summary.landmark_count = 19;
  state.summary.step_flags = 0x20;
  state.summary.max_displacement_mm = 1.25;
  state.summary.moved_vertices = 3;
  NeedleState& needle = state.needles.states.emplace_back();
  needle.contact = ContactState::kInserted;
  needle.landmark_count = 11;
  needle.insertion_depth_mm = 12.5;
  needle.X_WN.p = {1, -2, 3};
  needle.forces.force_n = {0.5, -0.25, 2};
  Seed seed;
  seed.id = 4;
  seed.rest = {5, 6, 7};
  seed.position = {8, 9, 10};
  seed.axis = {0, 0.6, 0.8};
  state.seeds.slots = {seed};
  state.seeds.count = 1;
  state.mesh.deformed_vertices = {1.5f, -2.5f, 3.5f};

  const auto bits = [](double v) { return std::bit_cast<std::uint64_t>(v); };
  const auto pair = [](float low, float high) {
    return std::uint64_t{std::bit_cast<std::uint32_t>(low)} |
           std::uint64_t{std::bit_cast<std::uint32_t>(high)} << 32;
  };
  const std::vector<std::uint64_t> words = {7,
                                            19 + (std::uint64_t{0x20} << 32),
                                            2 + 11 * 256,
                                            bits(12.5),
                                            bits(1),
                                            bits(-2),
                                            bits(3),
                                            bits(0.5),
                                            bits(-0.25),
                                            bits(2),
                                            4,
                                            bits(5),
                                            bits(6),
                                            bits(7),
                                            bits(8),
                                            bits(9),
                                            bits(10),
                                            bits(0),
                                            bits(0.6),
                                            bits(0.8),
                                            bits(1.25),
                                            3,
                                            pair(1.5f, -2.5f),
                                            bits(3.5)};
  StateHash hash;
  hash.add(state);
  EXPECT_EQ(hash.value(), documented_hash(words));
}

}  // namespace
}  // namespace brachy
