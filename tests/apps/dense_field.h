#pragma once

#include <array>
#include <string>
#include <vector>

namespace brachy::test {

/// The interpolant again, independent of the product and in long double: the tests' kernel formulas, dense matrix,
/// Gaussian elimination. The oracle of `brachy deform`.
class DenseField {
 public:
  using Real = long double;
  using Vec = std::array<Real, 3>;
  struct Landmark {
    Vec p, d;
  };

  DenseField(std::string kernel, double support, std::vector<Landmark> landmarks);

  Vec displacement(const Vec& x) const;
  /// det(I + ∇u); at a landmark of psi30, which has a cusp there, without that landmark's own term.
  Real determinant(const Vec& x) const;

 private:
  std::string kernel_;
  Real support_;
  std::vector<Landmark> landmarks_;
  std::vector<Vec> weights_;
};

}  // namespace brachy::test
