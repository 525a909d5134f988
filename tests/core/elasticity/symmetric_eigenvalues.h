#pragma once

#include <Eigen/Core>

namespace brachy::test {

/// Of a symmetric matrix, in ascending order. Compiled once for all tests: Eigen's solver takes seconds in each.
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A);

}  // namespace brachy::test
