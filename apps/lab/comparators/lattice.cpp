#include "apps/lab/comparators/lattice.h"

#include <algorithm>
#include <cmath>

namespace brachy {

Lattice::Lattice(const Vec3& box_centre, const Vec3& box_size, double spacing)
    : min_(box_centre - 0.5 * box_size) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double cells = std::max(1.0, std::round(box_size[a] / spacing));
    count_[axis] = static_cast<std::size_t>(cells) + 1;
    cell_[a] = box_size[a] / cells;
  }
}

std::array<std::size_t, 3> Lattice::place(std::size_t node) const {
  return {node % count_[0], node / count_[0] % count_[1], node / stride(2)};
}

std::size_t Lattice::node(const std::array<std::size_t, 3>& place) const {
  return place[0] + place[1] * stride(1) + place[2] * stride(2);
}

Vec3 Lattice::position(std::size_t node) const {
  const auto p = place(node);
  return min_ + cell_.cwiseProduct(
                    Vec3(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])));
}

std::size_t Lattice::nearest(const Vec3& X) const {
  std::array<std::size_t, 3> p;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    p[axis] = static_cast<std::size_t>(
        std::clamp(std::round((X[a] - min_[a]) / cell_[a]), 0.0, static_cast<double>(count_[axis] - 1)));
  }
  return node(p);
}

bool Lattice::is_held(std::size_t node, const ElasticBody& body) const {
  const auto p = place(node);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (p[axis] == 0 && body.held[2 * axis]) return true;
    if (p[axis] + 1 == count_[axis] && body.held[2 * axis + 1]) return true;
  }
  return false;
}

Lattice::Place Lattice::locate(const Vec3& X) const {
  Place result;
  std::array<std::size_t, 3> p;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const double at = (X[a] - min_[a]) / cell_[a];
    p[axis] =
        static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, static_cast<double>(count_[axis] - 2)));
    result.share[axis] = static_cast<float>(at - static_cast<double>(p[axis]));
  }
  result.first = static_cast<std::uint32_t>(node(p));
  return result;
}

Vec3 Lattice::interpolate(const Place& place, const std::array<std::vector<float>, 3>& u) const {
  const float x = place.share[0], y = place.share[1], z = place.share[2];
  Vec3 result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* v = u[axis].data() + place.first;
    const auto along_x = [&](std::size_t at) { return v[at] + x * (v[at + 1] - v[at]); };
    const auto in_plane = [&](std::size_t at) {
      const float low = along_x(at);
      return low + y * (along_x(at + stride(1)) - low);
    };
    const float low = in_plane(0);
    result[static_cast<Eigen::Index>(axis)] = low + z * (in_plane(stride(2)) - low);
  }
  return result;
}

Vec3 ImposedNode::displacement(std::span<const Vec3> of_landmarks) const {
  Vec3 sum = Vec3::Zero();
  for (const std::size_t l : landmarks) sum += of_landmarks[l];
  return sum / static_cast<double>(landmarks.size());
}

std::vector<ImposedNode> impose(const Lattice& lattice, std::span<const Vec3> landmarks) {
  std::vector<ImposedNode> imposed;
  for (std::size_t l = 0; l < landmarks.size(); ++l) {
    const std::size_t node = lattice.nearest(landmarks[l]);
    const auto known =
        std::ranges::find_if(imposed, [&](const ImposedNode& other) { return other.node == node; });
    if (known == imposed.end())
      imposed.push_back({node, {l}});
    else
      known->landmarks.push_back(l);
  }
  return imposed;
}

}  // namespace brachy
