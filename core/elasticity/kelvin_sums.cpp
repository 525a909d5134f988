#include "core/elasticity/kelvin_sums.h"

#include <algorithm>
#include <cmath>

#include "core/elasticity/kelvin.h"

namespace brachy {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd kelvin_rows(std::span<const Vec3> p, std::span<const double> s, const PointGroups& groups,
                     double poisson) {
  MatrixXd rows = MatrixXd::Zero(static_cast<Index>(3 * p.size()), static_cast<Index>(3 * groups.size()));
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (std::uint32_t q = groups.first[g]; q < groups.first[g + 1]; ++q)
      for (std::size_t i = 0; i < p.size(); ++i)
        rows.block<3, 3>(static_cast<Index>(3 * i), static_cast<Index>(3 * g)) +=
            groups.weights[q] * kelvin(p[i] - groups.points[q], s[i] + groups.smooth_s[q], poisson);
  return rows;
}

MatrixXd kelvin_between(const PointGroups& a, const PointGroups& b, double poisson) {
  MatrixXd K = MatrixXd::Zero(static_cast<Index>(3 * a.size()), static_cast<Index>(3 * b.size()));
  for (std::size_t h = 0; h < b.size(); ++h)
    for (std::size_t g = 0; g < a.size(); ++g) {
      Mat3 sum = Mat3::Zero();
      for (std::uint32_t q = b.first[h]; q < b.first[h + 1]; ++q)
        for (std::uint32_t p = a.first[g]; p < a.first[g + 1]; ++p)
          sum += a.weights[p] * b.weights[q] *
                 kelvin(a.points[p] - b.points[q],
                        PointCore::between(a.s[p], a.is_landmark[p], b.s[q], b.is_landmark[q]), poisson);
      K.block<3, 3>(static_cast<Index>(3 * g), static_cast<Index>(3 * h)) = sum;
    }
  return K;
}

MatrixXd kelvin_fields(std::span<const Vec3> X, std::span<const Vec3> p, std::span<const double> s,
                       const MatrixXd& forces, double poisson) {
  // Points are taken in blocks that stay in the first cache, and the loops over a block vectorise.
  constexpr std::size_t kBlock = 64;
  constexpr double kShare = 1 / (4 * std::numbers::pi);
  const double b = 1 / (4 * (1 - poisson));
  const Index sets = forces.cols();
  MatrixXd u(static_cast<Index>(3 * X.size()), sets);
  double x[3][kBlock], d[3][kBlock], along[kBlock], even[kBlock];
  std::vector<double> sums(3 * kBlock * static_cast<std::size_t>(sets));
  for (std::size_t first = 0; first < X.size(); first += kBlock) {
    const std::size_t count = std::min(kBlock, X.size() - first);
    for (std::size_t i = 0; i < kBlock; ++i)  // the last block is filled up with its last point
      for (int k = 0; k < 3; ++k) x[k][i] = X[first + std::min(i, count - 1)][k];
    std::ranges::fill(sums, 0);
    for (std::size_t j = 0; j < p.size(); ++j) {
      const double px = p[j].x(), py = p[j].y(), pz = p[j].z(), sj = s[j];
      for (std::size_t i = 0; i < kBlock; ++i) {
        d[0][i] = x[0][i] - px;
        d[1][i] = x[1][i] - py;
        d[2][i] = x[2][i] - pz;
        const double r2 = d[0][i] * d[0][i] + d[1][i] * d[1][i] + d[2][i] * d[2][i] + sj;
        const double i1 = 1 / std::sqrt(r2), i3 = i1 * i1 * i1;
        along[i] = b * i3;
        even[i] = (1 - b) * i1 + 0.5 * sj * i3;
      }
      for (Index m = 0; m < sets; ++m) {
        const double* f = forces.data() + m * forces.rows() + 3 * static_cast<Index>(j);
        const double fx = f[0], fy = f[1], fz = f[2];
        double* __restrict sum = sums.data() + 3 * kBlock * static_cast<std::size_t>(m);
        for (std::size_t i = 0; i < kBlock; ++i) {
          const double t = along[i] * (d[0][i] * fx + d[1][i] * fy + d[2][i] * fz);
          sum[i] += even[i] * fx + t * d[0][i];
          sum[kBlock + i] += even[i] * fy + t * d[1][i];
          sum[2 * kBlock + i] += even[i] * fz + t * d[2][i];
        }
      }
    }
    for (Index m = 0; m < sets; ++m)
      for (std::size_t i = 0; i < count; ++i)
        for (std::size_t k = 0; k < 3; ++k)
          u(static_cast<Index>(3 * (first + i) + k), m) =
              kShare * sums[kBlock * (3 * static_cast<std::size_t>(m) + k) + i];
  }
  return u;
}

}  // namespace brachy
