#pragma once

#include <cstdlib>
#include <span>
#include <string_view>
#include <vector>

#include "core/models/blocks/block_field.h"
#include "core/solve/rbf_system.h"

namespace brachy::bench {

/// The parts of a tick in which everything is rebuilt, to be timed apart: what ScalarKernelField::update does when
/// landmark rest positions have changed.
class RebuiltTick {
 public:
  RebuiltTick(const Tissue& tissue, std::string_view kernel, double support_radius, std::size_t landmarks,
              SimdTarget target, int threads = 1)
      : system_(*find_kernel(kernel), support_radius, static_cast<int>(landmarks)),
        field_(tissue, *find_kernel(kernel), support_radius,
               {.target = target, .threads = threads, .max_landmarks = landmarks}),
        weights_(landmarks) {}

  /// Assembly, factor, substitution.
  void solve(std::span<const Vec3> positions, std::span<const Vec3> displacements) {
    if (!system_.factorize(positions)) std::abort();  // cannot fail for the benchmark's landmarks
    system_.solve(displacements, weights_);
  }
  void cull(std::span<const Vec3> positions) { field_.set_landmarks(positions); }
  void evaluate() { field_.evaluate(weights_); }

  const BlockField& field() const { return field_; }

 private:
  RbfSystem system_;
  BlockField field_;
  std::vector<Vec3> weights_;
};

}  // namespace brachy::bench
