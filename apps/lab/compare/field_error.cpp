#include "apps/lab/compare/field_error.h"

#include <algorithm>
#include <cmath>

namespace brachy {

FieldError field_error(std::span<const Vec3> u, std::span<const Vec3> reference) {
  FieldError errors;
  double wrong = 0, all = 0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double error = (u[i] - reference[i]).norm();
    wrong += error * error;
    all += reference[i].squaredNorm();
    errors.max_mm = std::max(errors.max_mm, error);
  }
  errors.rel_l2 = std::sqrt(wrong / all);
  return errors;
}

}  // namespace brachy
