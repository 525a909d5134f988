#include "apps/python/engine/pose_arrays.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace brachy {

NeedlePose pose_of(std::span<const double> numbers, std::string& error) {
  NeedlePose pose;
  if (std::ranges::all_of(numbers, [](double x) { return std::isnan(x); })) return pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      pose.X_WN.R(row, column) = numbers[static_cast<std::size_t>(4 * row + column)];
    pose.X_WN.p[row] = numbers[static_cast<std::size_t>(4 * row + 3)];
  }
  constexpr std::array<double, 4> kLastRow{0, 0, 0, 1};
  if (!pose.X_WN.R.allFinite() || !pose.X_WN.p.allFinite())
    error = "has numbers that are not finite (a needle that is not there is NaN throughout)";
  else if (rigidity_error(pose.X_WN) > kPoseRigidity)
    error = "is not rigid: its first three columns are no rotation to 1e-3";
  else if (pose.X_WN.p.norm() > kFarthestTipMm)
    error = "has its tip more than 10 m away; lengths are mm";
  else if (numbers.size() == 16 && !std::ranges::equal(numbers.subspan(12), kLastRow))
    error = "has a last row other than 0 0 0 1";
  pose.present = error.empty();
  return pose;
}

}  // namespace brachy
