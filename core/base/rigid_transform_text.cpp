#include "core/base/rigid_transform_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

namespace brachy {

std::optional<RigidTransform> rigid_transform_from(std::string_view text) {
  constexpr double kTolerance = 1e-3;
  std::array<double, 16> m{};
  m[15] = 1;
  std::size_t count = 0;
  for (;;) {
    text.remove_prefix(std::min(text.find_first_not_of(" ,\t\n"), text.size()));
    if (text.empty()) break;
    if (count == m.size()) return std::nullopt;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), m[count++]);
    if (error != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  }
  if ((count != 12 && count != 16) || m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
    return std::nullopt;
  RigidTransform X;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      X.R(row, column) = m[static_cast<std::size_t>(4 * row + column)];
    X.p[row] = m[static_cast<std::size_t>(4 * row + 3)];
  }
  if (!X.p.allFinite() || !(rigidity_error(X) <= kTolerance)) return std::nullopt;
  if (rigidity_error(X) > 0) X.R = Eigen::Quaterniond(X.R).normalized().toRotationMatrix();
  return X;
}

}  // namespace brachy
