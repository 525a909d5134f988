#include <iostream>
#include <vector>
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"
int main() {
  const std::vector<brachy::Vec3> p{{0, 0, 0}, {0, 0, 10}};  // landmarks at rest, mm: a tip, an anchor
  const std::vector<brachy::Vec3> d{{0, 0, 2}, {0, 0, 0}};   // their displacements, mm
  brachy::RbfSystem system(brachy::Wendland31{}, 12, 2);     // kernel, support radius in mm, most landmarks
  if (!system.factorize(p)) return 3;                        // once for each set of landmarks
  std::vector<brachy::Vec3> weights(2);
  system.solve(d, weights);  // as often as the needle moves
  const brachy::RbfField field{brachy::Wendland31{}, 12, p, weights};
  std::cout << field.displacement({0, 3, 0}).transpose() << " mm, det " << field.jacobian({0, 3, 0}) << "\n";
}
