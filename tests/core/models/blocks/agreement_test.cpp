// Every evaluation path against a dense solve and sum in long double.
#include <gtest/gtest.h>

#include <cmath>

#include "core/models/scalar_kernel/scalar_kernel_field.h"
#include "tests/core/kernels/kernel_formulas.h"
#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

using test::displacements_of;
using test::RandomLandmarks;
using test::uniform;

using LongVec = Eigen::Matrix<long double, 3, 1>;

long double psi(std::string_view kernel, long double r) {
  return test::reference_psi(test::formula_of(kernel), r);
}

std::vector<LongVec> reference_weights(std::string_view kernel, double a, const RandomLandmarks& L) {
  const std::size_t n = L.positions.size();
  std::vector<std::vector<long double>> K(n, std::vector<long double>(n));
  std::vector<LongVec> w(n);
  for (std::size_t i = 0; i < n; ++i) {
    w[i] = L.displacements[i].cast<long double>();
    for (std::size_t j = 0; j < n; ++j)
      K[i][j] =
          psi(kernel, (L.positions[i].cast<long double>() - L.positions[j].cast<long double>()).norm() / a);
  }
  for (std::size_t k = 0; k < n; ++k) {  // Gauss without pivoting: K is positive definite
    for (std::size_t i = k + 1; i < n; ++i) {
      const long double f = K[i][k] / K[k][k];
      for (std::size_t j = k; j < n; ++j) K[i][j] -= f * K[k][j];
      w[i] -= f * w[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) w[k] -= K[k][j] * w[j];
    w[k] /= K[k][k];
  }
  return w;
}

struct Agreement : ::testing::TestWithParam<Kernel> {
  Agreement() {
    for (std::size_t i = 0; i < tissue.size(); i += 23) sampled.push_back(i);
  }
  std::vector<LongVec> reference(double a, const RandomLandmarks& L) const {
    const auto w = reference_weights(name, a, L);
    std::vector<LongVec> u;
    for (const std::size_t i : sampled) {
      LongVec sum = LongVec::Zero();
      for (std::size_t j = 0; j < w.size(); ++j)
        sum += psi(name,
                   (tissue.rest_vertices[i].cast<long double>() - L.positions[j].cast<long double>()).norm() /
                       a) *
               w[j];
      u.push_back(sum);
    }
    return u;
  }
  double worst(const std::vector<Vec3>& u, const std::vector<LongVec>& expected) const {
    double error = 0;
    for (std::size_t k = 0; k < sampled.size(); ++k)
      error = std::max(error, static_cast<double>((u[sampled[k]].cast<long double>() - expected[k]).norm()));
    return error;
  }

  const Tissue tissue = test::small_phantom(Vec3::Zero());
  const std::string name{name_of(GetParam())};
  std::vector<std::size_t> sampled;
};

// 1,000 sets for each kernel, spacing at least a/8, each displacement up to 10 mm.
TEST_P(Agreement, EveryWayEqualsLongDouble) {
  std::mt19937_64 random(11);
  const auto targets = test::supported_targets();
  for (int trial = 0; trial < 1000; ++trial) {
    const double a = uniform(random, 6, 40);
    const int n = 1 + static_cast<int>(random() % 24);
    RandomLandmarks L = test::random_landmarks(random, n, 24, a / 8, 10 / std::sqrt(3.0));
    for (int j = 1; j < n; j += 2) L.displacements[static_cast<std::size_t>(j)] = Vec3::Zero();  // anchors
    const auto expected = reference(a, L);

    ScalarKernelField deformation(tissue, GetParam(), a,
                                  {.target = targets[static_cast<std::size_t>(trial) % targets.size()]});
    LandmarkSet landmarks = LandmarkSet::of(L.positions, L.displacements);
    ASSERT_TRUE(deformation.update(landmarks));
    ASSERT_EQ(deformation.evaluation(), Evaluation::kDirect);
    ASSERT_LT(worst(displacements_of(deformation.blocks(), tissue), expected), 1e-5)
        << trial << " a=" << a << " n=" << n;
    std::vector<Vec3> plain(tissue.size(), Vec3::Zero());
    for (const std::size_t i : sampled) plain[i] = deformation.field().displacement(tissue.rest_vertices[i]);
    ASSERT_LT(worst(plain, expected), 1e-9) << trial << " a=" << a << " n=" << n;

    // The landmarks stay and their displacements change, until the blocks are condensed.
    const RandomLandmarks first = L;
    for (int tick = 0; tick < 60 && deformation.evaluation() != Evaluation::kCondensed; ++tick) {
      for (int j = 0; j < n; j += 2)
        L.displacements[static_cast<std::size_t>(j)] = 0.1 * (tick % 7) * Vec3(1, -1, 0.5);
      landmarks.assign(L.positions, L.displacements);
      ASSERT_TRUE(deformation.update(landmarks));
    }
    if (deformation.evaluation() != Evaluation::kCondensed)
      continue;  // direct evaluation is cheaper for this set
    landmarks.assign(first.positions, first.displacements);
    ASSERT_TRUE(deformation.update(landmarks));
    ASSERT_LT(worst(displacements_of(deformation.blocks(), tissue), expected), 1e-5)
        << "condensed, " << trial;
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, Agreement, ::testing::ValuesIn(test::all_kernels()),
                         [](const auto& p) { return std::string(name_of(p.param)); });

}  // namespace
}  // namespace brachy
