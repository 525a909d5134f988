#include "core/geometry/surface/surface_bvh.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

namespace brachy {
namespace {

struct Box {
  Vec3 min = Vec3::Constant(1e300), max = Vec3::Constant(-1e300);

  void add(const Box& other) {
    min = min.cwiseMin(other.min);
    max = max.cwiseMax(other.max);
  }
  double half_area() const {
    const Vec3 e = (max - min).cwiseMax(0.0);
    return e.x() * e.y() + e.y() * e.z() + e.z() * e.x();
  }
};

}  // namespace

/// Top-down build; splits by the surface area heuristic over bins (Wald 2007), by the median once a branch is
/// deep, which bounds the depth by kSahDepth + 32 < kMaxDepth.
struct SurfaceBvh::Builder {
  static constexpr std::uint32_t kLeafSize = 4;
  static constexpr std::size_t kBins = 12, kSahDepth = 30;

  SurfaceBvh& bvh;
  std::vector<Box> boxes;
  std::vector<Vec3> centres;
  Vec3 padding = Vec3::Zero();

  explicit Builder(SurfaceBvh& target) : bvh(target) {
    const SurfaceMesh& mesh = bvh.mesh_;
    boxes.resize(mesh.triangles.size());
    centres.resize(mesh.triangles.size());
    for (std::size_t t = 0; t < boxes.size(); ++t) {
      for (const std::uint32_t v : mesh.triangles[t]) boxes[t].add({mesh.vertices[v], mesh.vertices[v]});
      centres[t] = 0.5 * (boxes[t].min + boxes[t].max);
    }
    bvh.order_.resize(boxes.size());
    std::iota(bvh.order_.begin(), bvh.order_.end(), 0u);
    bvh.nodes_.reserve(boxes.size());
    bvh.nodes_.emplace_back();
    // Boxes are slightly enlarged, so that rounding in a query's box test cannot lose a triangle.
    const Box whole = bounds(0, static_cast<std::uint32_t>(boxes.size()));
    const double scale = std::max(whole.min.cwiseAbs().maxCoeff(), whole.max.cwiseAbs().maxCoeff());
    padding = Vec3::Constant(1e-9 * (whole.max - whole.min).maxCoeff() + 1e-13 * scale);
    split(0, 0, static_cast<std::uint32_t>(boxes.size()), 0);
  }

  Box bounds(std::uint32_t first, std::uint32_t last) const {
    Box box;
    for (std::uint32_t i = first; i < last; ++i) box.add(boxes[bvh.order_[i]]);
    return box;
  }

  void split(std::size_t node, std::uint32_t first, std::uint32_t last, std::size_t depth) {
    const Box box = bounds(first, last);
    bvh.nodes_[node] = {box.min - padding, box.max + padding, first, last - first};
    if (last - first <= kLeafSize) return;
    const std::uint32_t middle = depth < kSahDepth ? sah_split(first, last) : median_split(first, last);
    const std::size_t left = bvh.nodes_.size();
    bvh.nodes_.resize(left + 2);
    bvh.nodes_[node].first = static_cast<std::uint32_t>(left);
    bvh.nodes_[node].count = 0;
    split(left, first, middle, depth + 1);
    split(left + 1, middle, last, depth + 1);
  }

  /// Widest axis of the centres, and their range on it.
  std::pair<int, Box> centre_range(std::uint32_t first, std::uint32_t last) const {
    Box box;
    for (std::uint32_t i = first; i < last; ++i) box.add({centres[bvh.order_[i]], centres[bvh.order_[i]]});
    int axis = 0;
    (box.max - box.min).maxCoeff(&axis);
    return {axis, box};
  }

  std::uint32_t median_split(std::uint32_t first, std::uint32_t last) {
    const int axis = centre_range(first, last).first;
    const std::uint32_t middle = first + (last - first) / 2;
    const auto begin = bvh.order_.begin();
    std::nth_element(begin + first, begin + middle, begin + last, [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(centres[a][axis], a) < std::pair(centres[b][axis], b);
    });
    return middle;
  }

  std::uint32_t sah_split(std::uint32_t first, std::uint32_t last) {
    const auto [axis, range] = centre_range(first, last);
    const double lo = range.min[axis], scale = kBins / (range.max[axis] - lo);
    if (!std::isfinite(scale)) return median_split(first, last);
    const auto bin_of = [&, a = axis](std::uint32_t t) {
      return std::min(static_cast<std::size_t>(scale * (centres[t][a] - lo)), kBins - 1);
    };
    std::array<Box, kBins> bin_boxes;
    std::array<std::size_t, kBins> bin_counts{};
    for (std::uint32_t i = first; i < last; ++i) {
      const std::size_t bin = bin_of(bvh.order_[i]);
      bin_boxes[bin].add(boxes[bvh.order_[i]]);
      ++bin_counts[bin];
    }
    std::array<double, kBins> right_cost{};
    Box box;
    std::size_t count = 0;
    for (std::size_t b = kBins; b-- > 1;) {
      box.add(bin_boxes[b]);
      count += bin_counts[b];
      right_cost[b] = count == 0 ? 0 : box.half_area() * static_cast<double>(count);
    }
    box = {};
    count = 0;
    std::size_t best = 0;
    double best_cost = 1e300;
    for (std::size_t b = 1; b < kBins; ++b) {
      box.add(bin_boxes[b - 1]);
      count += bin_counts[b - 1];
      if (count == 0 || count == last - first) continue;
      const double cost = box.half_area() * static_cast<double>(count) + right_cost[b];
      if (cost < best_cost) best = b, best_cost = cost;
    }
    if (best == 0) return median_split(first, last);
    const auto begin = bvh.order_.begin();
    const auto middle =
        std::partition(begin + first, begin + last, [&](std::uint32_t t) { return bin_of(t) < best; });
    return static_cast<std::uint32_t>(middle - begin);
  }
};

SurfaceBvh::SurfaceBvh(SurfaceMesh mesh) : mesh_(std::move(mesh)) {
  assert(!mesh_.triangles.empty());
  Builder builder(*this);
  compute_normals();
}

void SurfaceBvh::compute_normals() {
  const std::size_t count = mesh_.triangles.size();
  face_normals_.assign(count, Vec3::Zero());
  vertex_normals_.assign(mesh_.vertices.size(), Vec3::Zero());
  neighbours_.resize(count);

  struct Edge {
    std::uint64_t key;
    std::uint32_t triangle, corner;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * count);
  for (std::uint32_t t = 0; t < count; ++t) {
    const Triangle& c = mesh_.triangles[t];
    assert(std::max({c[0], c[1], c[2]}) < mesh_.vertices.size());
    const Vec3 n =
        (mesh_.vertices[c[1]] - mesh_.vertices[c[0]]).cross(mesh_.vertices[c[2]] - mesh_.vertices[c[0]]);
    if (n.squaredNorm() > 0) face_normals_[t] = n.normalized();
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t v = c[k], next = c[(k + 1) % 3], last = c[(k + 2) % 3];
      neighbours_[t][k] = t;
      edges.push_back({std::uint64_t{std::min(v, next)} << 32 | std::max(v, next), t, k});
      const Vec3 a = mesh_.vertices[next] - mesh_.vertices[v], b = mesh_.vertices[last] - mesh_.vertices[v];
      vertex_normals_[v] += std::atan2(a.cross(b).norm(), a.dot(b)) * face_normals_[t];
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
  });
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    const Edge &a = edges[i], &b = edges[i + 1];
    if (a.key != b.key) continue;
    neighbours_[a.triangle][a.corner] = b.triangle;
    neighbours_[b.triangle][b.corner] = a.triangle;
  }
  // A degenerate triangle has no normal; it takes the mean of its neighbours'.
  for (std::uint32_t t = 0; t < count; ++t) {
    if (!face_normals_[t].isZero(0)) continue;
    Vec3 n = Vec3::Zero();
    for (const std::uint32_t neighbour : neighbours_[t]) n += face_normals_[neighbour];
    face_normals_[t] = n.squaredNorm() > 0 ? Vec3(n.normalized()) : Vec3::UnitZ();
  }
}

}  // namespace brachy
