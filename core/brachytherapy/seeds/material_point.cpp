#include "core/brachytherapy/seeds/material_point.h"

#include <algorithm>
#include <Eigen/LU>
#include <vector>

namespace brachy {
namespace {

constexpr double kStep = 1e-3;  // mm, of the differences: u is smooth over mm, and single precision in tables
constexpr int kHalvings = 12;   // of one Newton step
constexpr double kSamePoint = 1e-3;  // mm: results of two searches closer than this are the same point
constexpr double kPolished = 1e-3;   // of the tolerance: no further step is needed

Vec3 deformed(const DisplacementField& field, const Vec3& X) noexcept {
  return X + field.displacement_at(X);
}

Mat3 gradient(const DisplacementField& field, const Vec3& X) noexcept {
  Mat3 F;
  for (int k = 0; k < 3; ++k) {
    const Vec3 h = kStep * Vec3::Unit(k);
    F.col(k) = (deformed(field, X + h) - deformed(field, X - h)) / (2 * kStep);
  }
  return F;
}

MaterialPoint search_from(const DisplacementField& field, const Vec3& x, const Vec3& start) noexcept {
  MaterialPoint point{.X = start};
  Vec3 rest = x - deformed(field, point.X);
  for (int step = 0; step < kInversionSteps && rest.norm() > kPolished * kInversionTolerance; ++step) {
    point.F = gradient(field, point.X);
    Vec3 way = point.F.partialPivLu().solve(rest);
    if (!way.allFinite()) break;
    bool is_nearer = false;
    for (int half = 0; half <= kHalvings && !is_nearer; ++half, way *= 0.5) {
      const Vec3 X = point.X + way, left = x - deformed(field, X);
      is_nearer = left.norm() < rest.norm();
      if (!is_nearer) continue;
      point.X = X;
      rest = left;
    }
    if (!is_nearer) break;  // at the limit of rounding, or stuck
  }
  if (!(rest.norm() <= kInversionTolerance)) return point;
  point.F = gradient(field, point.X);
  point.result = point.F.determinant() > 0 ? Inversion::kFound : Inversion::kFolded;
  return point;
}

}  // namespace

MaterialPoint find_material_point(const DisplacementField& field, Verdict verdict, const Vec3& x,
                                  const Vec3& guess) noexcept {
  MaterialPoint found = search_from(field, x, guess);
  if (verdict == Verdict::kInjective && found.result == Inversion::kFound) return found;
  // These starting points find the far side of a fold, if there is one.
  for (const Vec3& start : {Vec3(x - field.displacement_at(x)), x}) {
    const MaterialPoint other = search_from(field, x, start);
    const bool is_other_found = other.result == Inversion::kFound;
    if (verdict == Verdict::kInjective && is_other_found) return other;
    if (found.result == Inversion::kFound || found.result == Inversion::kAmbiguous) {
      if (!is_other_found || (other.X - found.X).norm() > kSamePoint) found.result = Inversion::kAmbiguous;
    } else if (is_other_found && found.result != Inversion::kFolded) {
      found = other;
      found.result = Inversion::kAmbiguous;
    }
  }
  if (verdict == Verdict::kFolded && found.result == Inversion::kFound) found.result = Inversion::kAmbiguous;
  return found;
}

void find_material_points(DisplacementField& field, Verdict verdict, std::span<const Vec3> x,
                          std::span<Vec3> X) {
  constexpr int kSteps = 40;
  constexpr double kAtRestMm = 1e-3;
  std::ranges::copy(x, X.begin());
  std::vector<Vec3> u(x.size());
  std::vector<double> step(x.size(), 0);
  for (int k = 0; k < kSteps; ++k) {
    field.displacements_at(X, u);
    double largest = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const Vec3 next = x[i] - u[i];
      step[i] = (next - X[i]).norm();
      largest = std::max(largest, step[i]);
      X[i] = next;
    }
    if (largest < kAtRestMm) return;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (step[i] < kAtRestMm) continue;
    const MaterialPoint point = find_material_point(field, verdict, x[i], x[i]);
    const bool is_found = point.result == Inversion::kFound || point.result == Inversion::kAmbiguous;
    X[i] = is_found ? point.X : x[i];
  }
}

}  // namespace brachy
