#include "core/seeds/material_point.h"

#include <array>

#include <Eigen/LU>

namespace brachy {
namespace {

constexpr double kStep = 1e-3;  // mm, of the differences: u is smooth over mm, and single precision in tables
constexpr int kHalvings = 12;   // of one Newton step
constexpr double kSamePoint = 1e-3;  // mm: what two searches may differ by and mean the same point
constexpr double kPolished = 1e-3;   // of the tolerance: no further step is worth it

Vec3 deformed(const TissueField& field, const Vec3& X) noexcept {
  return X + field.displacement_at(X);
}

Mat3 gradient(const TissueField& field, const Vec3& X) noexcept {
  Mat3 F;
  for (int k = 0; k < 3; ++k) {
    const Vec3 h = kStep * Vec3::Unit(k);
    F.col(k) = (deformed(field, X + h) - deformed(field, X - h)) / (2 * kStep);
  }
  return F;
}

MaterialPoint search_from(const TissueField& field, const Vec3& x, const Vec3& start) noexcept {
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
    if (!is_nearer) break;  // as near as rounding lets it, or stuck
  }
  if (!(rest.norm() <= kInversionTolerance)) return point;
  point.F = gradient(field, point.X);
  point.result = point.F.determinant() > 0 ? Inversion::kFound : Inversion::kAmbiguous;
  return point;
}

}  // namespace

MaterialPoint find_material_point(const TissueField& field, Verdict verdict, const Vec3& x) noexcept {
  if (verdict == Verdict::kFolded) return {.result = Inversion::kFolded, .X = x};
  const Vec3 u = field.displacement_at(x);
  MaterialPoint found = search_from(field, x, x - u);
  if (verdict == Verdict::kInjective && found.result == Inversion::kFound) return found;

  const double reach = 2 * u.norm() + 1;  // mm: a fold that matters is about as far off as things move
  const std::array<Vec3, 7> ways = {Vec3::Zero(),   Vec3::UnitX(), -Vec3::UnitX(), Vec3::UnitY(),
                                    -Vec3::UnitY(), Vec3::UnitZ(), -Vec3::UnitZ()};
  for (const Vec3& way : ways) {
    const MaterialPoint other = search_from(field, x, x + reach * way);
    if (other.result == Inversion::kNotConverged) continue;
    if (verdict == Verdict::kInjective && other.result == Inversion::kFound) return other;
    if (found.result == Inversion::kNotConverged) found = other;
    if (other.result == Inversion::kAmbiguous || (other.X - found.X).norm() > kSamePoint)
      found.result = Inversion::kAmbiguous;
  }
  return found;
}

}  // namespace brachy
