#include "tests/core/elasticity/symmetric_eigenvalues.h"

#include <Eigen/Eigenvalues>

namespace brachy::test {

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace brachy::test
