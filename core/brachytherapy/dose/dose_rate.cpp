#include "core/brachytherapy/dose/dose_rate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

constexpr double kReferenceRCm = 1;  // r₀; θ₀ is 90°

// The interval of increasing nodes x that contains v, or the first or last one for a v before or after them all.
std::size_t interval(std::span<const double> x, double v) {
  const auto above = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), v) - x.begin());
  return std::clamp<std::size_t>(above, 1, x.size() - 1) - 1;
}

// Position of v in interval i of x: 0 … 1, clamped outside.
double share(std::span<const double> x, std::size_t i, double v) {
  return std::clamp((v - x[i]) / (x[i + 1] - x[i]), 0.0, 1.0);
}

}  // namespace

double geometry_function(double active_length_cm, double rho_cm, double z_cm) {
  const double L = active_length_cm;
  const double q = rho_cm * rho_cm + (std::abs(z_cm) - L / 2) * (std::abs(z_cm) + L / 2);
  if (rho_cm == 0 && q > 0) return 1 / q;
  return std::atan2(L * rho_cm, q) / (L * rho_cm);
}

double radial_dose_function(const Tg43Source& source, double r_cm) {
  const std::span<const double> r = source.g_r_cm, g = source.g;
  if (r_cm <= r.front()) return g.front();
  const std::size_t i = interval(r, r_cm);
  // From the last node on the line starts at that node's value, so that the function is continuous there.
  const std::size_t start = r_cm >= r.back() ? i + 1 : i;
  return g[start] * std::pow(g[i + 1] / g[i], (r_cm - r[start]) / (r[i + 1] - r[i]));
}

double anisotropy_function(const Tg43Source& source, double r_cm, double theta_deg) {
  const std::size_t columns = source.F_r_cm.size();
  const std::size_t j = interval(source.F_r_cm, r_cm), i = interval(source.F_theta_deg, theta_deg);
  const double s = share(source.F_r_cm, j, r_cm), t = share(source.F_theta_deg, i, theta_deg);
  const double *lower = &source.F[i * columns + j], *upper = lower + columns;
  return (1 - t) * ((1 - s) * lower[0] + s * lower[1]) + t * ((1 - s) * upper[0] + s * upper[1]);
}

double dose_rate_per_u(const Tg43Source& source, double along_mm, double away_mm) {
  const double depth =
      std::min(source.capsule_diameter_mm / 2 - away_mm, source.capsule_length_mm / 2 - std::abs(along_mm));
  const double outwards = std::max(depth, 0.0);
  const double z = (std::abs(along_mm) + outwards) / 10, rho = (away_mm + outwards) / 10;
  const double along = source.is_symmetric() ? z : std::copysign(z, along_mm);
  const double r = std::hypot(z, rho), theta_deg = std::atan2(rho, along) * (180 / std::numbers::pi);
  const double L = source.active_length_cm;  // G is even in z
  return source.dose_rate_constant * geometry_function(L, rho, z) / geometry_function(L, kReferenceRCm, 0) *
         radial_dose_function(source, r) * anisotropy_function(source, r, theta_deg);
}

double dose_rate_cgy_h(const DoseSeed& seed, const Vec3& p) {
  const Vec3 d = p - seed.position;
  // The cross product keeps ρ's digits near the axis, where r² − z² would lose them.
  return seed.air_kerma_strength_u *
         dose_rate_per_u(tg43_source(seed.source), d.dot(seed.axis), seed.axis.cross(d).norm());
}

double total_gy_per_cgy_h(SourceModel model) {
  return 0.01 * tg43_source(model).half_life_h() / std::numbers::ln2;
}

double total_dose_gy(std::span<const DoseSeed> seeds, const Vec3& p) {
  double sum = 0;
  for (const DoseSeed& seed : seeds) sum += total_gy_per_cgy_h(seed.source) * dose_rate_cgy_h(seed, p);
  return sum;
}

}  // namespace brachy
