#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "core/base/rigid_transform.h"

namespace brachy::bench {

/// The paper's method, directly from its section 2 and as its own code would be built today (-O3 -march=native): dense
/// K and Cholesky from scratch each time, then one OpenMP loop over all points and all landmarks, in double. The
/// baseline of every comparison, in the same run; it shares no code with the engine.
class __attribute__((visibility("default"))) PaperBaseline {
 public:
  /// `kernel`: psi30, psi31, psi32 or buhmann. `support_radius` in mm.
  PaperBaseline(std::string_view kernel, double support_radius);
  ~PaperBaseline();

  void solve(std::span<const Vec3> positions, std::span<const Vec3> displacements);
  /// u at each of `points`.
  void evaluate(std::span<const Vec3> points, std::span<Vec3> u, int threads = 1) const;

 private:
  struct System;  // Eigen's types in here are the baseline's own
  std::unique_ptr<System> system_;
};

}  // namespace brachy::bench
