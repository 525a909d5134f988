#include "core/solve/inverse_block.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/core/models/blocks/small_tissue.h"
#include "tests/core/solve/random_landmarks.h"

namespace brachy {
namespace {

// A factor within a larger matrix, as in the fields.
struct Factor {
  Factor(std::mt19937_64& random, Eigen::Index n) : storage(n + 5, n + 5), K(n, n) {
    Eigen::MatrixXd A(n, n);
    for (double& x : A.reshaped()) x = test::uniform(random, -1, 1);
    K = A * A.transpose() + static_cast<double>(n) * Eigen::MatrixXd::Identity(n, n);
    storage.setConstant(1e300);  // never read
    storage.topLeftCorner(n, n).triangularView<Eigen::Lower>() = K.llt().matrixL().toDenseMatrix();
  }
  auto lower() const { return storage.topLeftCorner(K.rows(), K.cols()); }
  Eigen::MatrixXd storage, K;
};

std::vector<Vec3> axes_of(std::mt19937_64& random, std::size_t m) {
  std::vector<Vec3> axes(m);
  for (Vec3& a : axes) a = test::uniform_point(random, 1).normalized();
  return axes;
}

TEST(InverseBlock, IsTheBlockOfTheInverseAtAnySize) {
  for (const SimdTarget target : test::supported_targets()) {
    std::mt19937_64 random(3);
    InverseBlock block(3 * 41, 41, target);
    for (const std::size_t n : {1u, 2u, 5u, 16u, 17u, 30u, 41u})
      for (const std::size_t first : {std::size_t{0}, n / 3, n - 1}) {
        const std::vector<Vec3> axes = axes_of(random, n - first);
        const auto m = static_cast<Eigen::Index>(axes.size());
        const Factor three(random, static_cast<Eigen::Index>(3 * n)),
            one(random, static_cast<Eigen::Index>(n));
        const Eigen::MatrixXd inverse3 = three.K.inverse(), inverse1 = one.K.inverse();
        Eigen::MatrixXd projected(m, m), scaled(m, m);
        block.project(three.lower(), first, axes, projected);
        block.scale(one.lower(), first, axes, scaled);
        for (Eigen::Index i = 0; i < m; ++i)
          for (Eigen::Index j = 0; j < m; ++j) {
            const auto row = static_cast<Eigen::Index>(first) + i,
                       column = static_cast<Eigen::Index>(first) + j;
            const Vec3 &a = axes[static_cast<std::size_t>(i)], &b = axes[static_cast<std::size_t>(j)];
            ASSERT_NEAR(projected(i, j), a.dot(inverse3.block<3, 3>(3 * row, 3 * column) * b), 1e-13);
            ASSERT_NEAR(scaled(i, j), inverse1(row, column) * a.dot(b), 1e-13)
                << n << " " << to_string(target);
          }
      }
  }
}

}  // namespace
}  // namespace brachy
