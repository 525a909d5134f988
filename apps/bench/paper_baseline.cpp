#include "apps/bench/paper_baseline.h"

#include <cmath>
#include <Eigen/Cholesky>
#include <vector>

namespace brachy::bench {
namespace {

enum class Psi { k30, k31, k32, kBuhmann };

template <Psi kPsi>
double psi(double r) {
  if (r >= 1) return 0;
  const double t = 1 - r, t2 = t * t;
  if constexpr (kPsi == Psi::k30) return t2;
  if constexpr (kPsi == Psi::k31) return t2 * t2 * (4 * r + 1);
  if constexpr (kPsi == Psi::k32) return t2 * t2 * t2 * (35.0 / 3 * r * r + 6 * r + 1);
  if (r <= 0) return 1;
  const double r2 = r * r, r4 = r2 * r2;
  return 12 * r4 * std::log(r) - 21 * r4 + 32 * r2 * r - 12 * r2 + 1;
}

/// Calls `work` with the kernel as a template argument.
template <class Work>
void with_psi(Psi kernel, Work work) {
  switch (kernel) {
    case Psi::k30:
      return work.template operator()<Psi::k30>();
    case Psi::k31:
      return work.template operator()<Psi::k31>();
    case Psi::k32:
      return work.template operator()<Psi::k32>();
    case Psi::kBuhmann:
      return work.template operator()<Psi::kBuhmann>();
  }
}

Psi find_psi(std::string_view name) {
  return name == "psi30"     ? Psi::k30
         : name == "psi32"   ? Psi::k32
         : name == "buhmann" ? Psi::kBuhmann
                             : Psi::k31;
}

}  // namespace

struct PaperBaseline::System {
  Psi kernel;
  double support_radius;
  std::vector<Vec3> positions;
  Eigen::Matrix<double, Eigen::Dynamic, 3> weights;
};

PaperBaseline::PaperBaseline(std::string_view kernel, double support_radius)
    : system_(std::make_unique<System>(System{find_psi(kernel), support_radius, {}, {}})) {}

PaperBaseline::~PaperBaseline() = default;

void PaperBaseline::solve(std::span<const Vec3> positions, std::span<const Vec3> displacements) {
  System& s = *system_;
  s.positions.assign(positions.begin(), positions.end());
  const auto n = static_cast<Eigen::Index>(positions.size());
  Eigen::MatrixXd K(n, n);
  Eigen::Matrix<double, Eigen::Dynamic, 3> d(n, 3);
  with_psi(s.kernel, [&]<Psi kPsi>() {
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto row = static_cast<std::size_t>(i);
      d.row(i) = displacements[row].transpose();
      for (Eigen::Index j = 0; j < n; ++j)
        K(i, j) = psi<kPsi>((s.positions[row] - s.positions[static_cast<std::size_t>(j)]).norm() /
                            s.support_radius);
    }
  });
  s.weights = K.llt().solve(d);
}

void PaperBaseline::evaluate(std::span<const Vec3> points, std::span<Vec3> u,
                             [[maybe_unused]] int threads) const {
  const System& s = *system_;
  with_psi(s.kernel, [&]<Psi kPsi>() {
    const auto count = static_cast<std::ptrdiff_t>(points.size());
#pragma omp parallel for schedule(static) num_threads(threads)
    for (std::ptrdiff_t q = 0; q < count; ++q) {
      Vec3 sum = Vec3::Zero();
      for (std::size_t i = 0; i < s.positions.size(); ++i) {
        const double r = (points[static_cast<std::size_t>(q)] - s.positions[i]).norm() / s.support_radius;
        if (r < 1) sum += psi<kPsi>(r) * s.weights.row(static_cast<Eigen::Index>(i)).transpose();
      }
      u[static_cast<std::size_t>(q)] = sum;
    }
  });
}

}  // namespace brachy::bench
