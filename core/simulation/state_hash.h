#pragma once

#include <cstdint>
#include <cstring>
#include <span>

#include "core/simulation/mesh_state.h"

namespace brachy {

/// A running hash over every tick's state: equal hashes mean that two runs did the same, bit for bit. FNV-1a's
/// constants over 64-bit words, for speed (175 kB a tick); not cryptographic.
class StateHash {
 public:
  void add(const MeshState& state) noexcept {
    const TickSummary& summary = state.summary;
    add_word(summary.tick);
    add_word(std::uint64_t{summary.landmark_count} | std::uint64_t{summary.step_flags} << 32);
    for (const NeedleState& needle : state.needles.states) {
      add_word(static_cast<std::uint64_t>(needle.contact) | std::uint64_t{needle.landmark_count} << 8);
      add_double(needle.insertion_depth_mm);
      for (int i = 0; i < 3; ++i) add_double(needle.X_WN.p[i]);
      for (int i = 0; i < 3; ++i) add_double(needle.forces.force_n[i]);
    }
    for (const Seed& seed : state.seeds.in_tissue()) {
      add_word(seed.id);
      for (const Vec3* v : {&seed.rest, &seed.position, &seed.axis})
        for (int i = 0; i < 3; ++i) add_double((*v)[i]);
    }
    add_double(summary.max_displacement_mm);
    add_word(summary.moved_vertices);
    const std::span<const float> x = state.mesh.deformed_vertices;
    for (std::size_t i = 0; i + 2 <= x.size(); i += 2) {
      std::uint64_t word;
      std::memcpy(&word, &x[i], sizeof word);
      add_word(word);
    }
    if (x.size() % 2) add_double(x.back());
  }
  std::uint64_t value() const { return hash_; }

 private:
  void add_word(std::uint64_t word) noexcept {
    hash_ = (hash_ ^ word) * 0x100000001b3ull;
    hash_ ^= hash_ >> 29;
  }
  void add_double(double v) noexcept {
    std::uint64_t word;
    std::memcpy(&word, &v, sizeof word);
    add_word(word);
  }
  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

}  // namespace brachy
