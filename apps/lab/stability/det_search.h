#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// ∇u at the points X (mm), one matrix a point, of a field whose landmarks are pushed by 1 mm.
using Gradients = std::function<std::vector<Mat3>(std::span<const Vec3> X)>;

/// Where det(I + p ∇u) is least for a push of p mm: at sample points first, then by compass search from the best of
/// them. Independent of bounds and certificates: a value it finds is attained; it may miss one between its samples.
/// Threads: one.
class DetSearch {
 public:
  struct Found {
    double det;
    Vec3 at;  ///< mm
  };
  using Counts = std::function<bool(const Vec3& X)>;

  /// `samples`: where to look first, mm; `reach`: first step of the descents, mm; `counts`: where there is tissue,
  /// everywhere if empty.
  DetSearch(Gradients of_unit_push, std::vector<Vec3> samples, double reach, Counts counts = {});

  Found least(double push) { return extreme(push, 1); }
  Found most(double push) { return extreme(push, -1); }  ///< the largest det instead

  /// The least over the samples so far, without evaluating gradients.
  double least_known(double push) const;

  /// The least push at which det ≤ 0 somewhere, by bisection, within 5e-4 of itself; none up to `most_push` mm.
  std::optional<double> fold(double most_push);

 private:
  Found extreme(double push, double sign);

  Gradients gradients_;
  std::vector<Vec3> samples_;  // grows by what the descents visit
  std::vector<Mat3> of_samples_;
  double reach_;
  Counts counts_;
};

/// The 26 unit vectors to a cube's faces, edges and corners.
const std::vector<Vec3>& compass();

/// Sample points for folds of landmarks at `positions` (mm): spheres about each, from 0.001 to 1 of `scale` mm, and a
/// lattice over all of them that reaches `scale` farther, of about `lattice_points`.
std::vector<Vec3> samples_around(std::span<const Vec3> positions, double scale,
                                 std::size_t lattice_points = 3000);

/// The least push at which `least_det` is ≤ 0, by doubling from most/64 and bisection, within 5e-4 of itself; none
/// up to `most` mm. Of a field that is linear in the push, a push beyond the fold folds too.
std::optional<double> push_at_fold(const std::function<double(double push)>& least_det, double most);

}  // namespace brachy
