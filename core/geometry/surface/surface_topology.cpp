#include "core/geometry/surface/surface_topology.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace brachy {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

bool position_less(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

/// Representatives by grid cell. Cells of 4 tolerances hold few, since representatives are more than one apart, however
/// close the vertices of a damaged mesh lie.
class RepresentativeGrid {
 public:
  RepresentativeGrid(std::size_t vertices, double tolerance) : tolerance_(tolerance), cell_(4 * tolerance) {
    heads_.reserve(vertices / 2);
  }

  /// The lowest representative within the tolerance of p, or kNone.
  std::uint32_t find(const Vec3& p, const std::vector<Vec3>& representatives) const {
    const Cell lo = cell_of(p - Vec3::Constant(tolerance_)), hi = cell_of(p + Vec3::Constant(tolerance_));
    std::uint32_t best = kNone;
    for (std::int64_t x = lo[0]; x <= hi[0]; ++x) {
      for (std::int64_t y = lo[1]; y <= hi[1]; ++y) {
        for (std::int64_t z = lo[2]; z <= hi[2]; ++z) {
          const auto head = heads_.find(key({x, y, z}));
          for (std::uint32_t r = head == heads_.end() ? kNone : head->second; r != kNone; r = next_[r]) {
            if (r < best && (representatives[r] - p).norm() <= tolerance_) best = r;
          }
        }
      }
    }
    return best;
  }

  void add(std::uint32_t representative, const Vec3& p) {
    const auto [head, fresh] = heads_.try_emplace(key(cell_of(p)), representative);
    next_.push_back(fresh ? kNone : head->second);
    head->second = representative;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell_of(const Vec3& p) const {
    Cell cell;
    // Clamped, because a stray vertex may lie anywhere; 2⁶⁰ cells are enough for the others.
    for (std::size_t k = 0; k < 3; ++k) {
      cell[k] =
          static_cast<std::int64_t>(std::clamp(std::floor(p[static_cast<int>(k)] / cell_), -0x1p60, 0x1p60));
    }
    return cell;
  }
  /// Cells with the same key share a list; the distance test tells their entries apart.
  static std::uint64_t key(const Cell& c) {
    std::uint64_t h = 0;
    for (const std::int64_t k : c)
      h = (h ^ static_cast<std::uint64_t>(k)) * 0x9E3779B97F4A7C15u, h ^= h >> 29;
    return h;
  }

  double tolerance_, cell_;
  std::unordered_map<std::uint64_t, std::uint32_t> heads_;
  std::vector<std::uint32_t> next_;
};

struct EdgeUse {
  std::uint64_t edge = 0;  ///< lower vertex << 32 | higher vertex
  std::uint32_t triangle = 0;
  bool forward = false;  ///< the triangle runs from the lower vertex to the higher
};

std::vector<EdgeUse> sorted_edge_uses(const std::vector<Triangle>& triangles) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      uses.push_back({std::min(a, b) << 32 | std::max(a, b), static_cast<std::uint32_t>(t), a < b});
    }
  }
  std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
  });
  return uses;
}

/// Calls visit(first, count) for each edge's run of uses.
template <class Visit>
void for_each_edge(const std::vector<EdgeUse>& uses, Visit&& visit) {
  for (std::size_t first = 0, last; first < uses.size(); first = last) {
    for (last = first + 1; last < uses.size() && uses[last].edge == uses[first].edge;) ++last;
    visit(first, last - first);
  }
}

/// Union-find that also stores whether a triangle is wound like its root.
class WoundSets {
 public:
  explicit WoundSets(std::size_t n) : parent_(n), flipped_(n, 0) {
    std::iota(parent_.begin(), parent_.end(), 0u);
  }

  std::uint32_t find(std::uint32_t t) {
    std::uint32_t root = t;
    std::uint8_t flip = 0;
    for (; parent_[root] != root; root = parent_[root]) flip ^= flipped_[root];
    while (parent_[t] != root && t != root) {
      const std::uint32_t up = parent_[t];
      const std::uint8_t here = flip ^ flipped_[t];
      parent_[t] = root;
      flipped_[t] = flip;
      flip = here;
      t = up;
    }
    return root;
  }

  /// Whether t must be turned over to agree with its root; after find(t).
  bool flipped(std::uint32_t t) const { return flipped_[t] != 0; }

  void join(std::uint32_t a, std::uint32_t b, bool turned) {
    std::uint32_t root_a = find(a), root_b = find(b);
    if (root_a == root_b) return;
    const bool flip = flipped(a) ^ flipped(b) ^ turned;
    if (root_b < root_a) std::swap(root_a, root_b);  // the lowest triangle is the root and sets the winding
    parent_[root_b] = root_a;
    flipped_[root_b] = flip;
  }

  std::vector<std::uint32_t> labels(std::size_t& count) {
    std::vector<std::uint32_t> label(parent_.size());
    count = 0;
    for (std::uint32_t t = 0; t < parent_.size(); ++t) {
      const std::uint32_t root = find(t);
      label[t] = root == t ? static_cast<std::uint32_t>(count++) : label[root];
    }
    return label;
  }

 private:
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint8_t> flipped_;
};

}  // namespace

Welding weld_vertices(const std::vector<Vec3>& vertices, double tolerance_mm) {
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return position_less(vertices[a], vertices[b]); });
  Welding welding;
  welding.representative.resize(vertices.size());
  RepresentativeGrid grid(vertices.size(), tolerance_mm);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Vec3& p = vertices[order[i]];
    std::uint32_t found = kNone;
    if (i > 0 && p == vertices[order[i - 1]]) {
      found = welding.representative[order[i - 1]];  // equal vertices, the common case, are adjacent
    } else if (tolerance_mm > 0) {
      found = grid.find(p, welding.vertices);
    }
    if (found == kNone) {
      found = static_cast<std::uint32_t>(welding.vertices.size());
      welding.vertices.push_back(p + Vec3::Zero());  // −0 becomes 0
      if (tolerance_mm > 0) grid.add(found, p);
    }
    welding.representative[order[i]] = found;
  }
  return welding;
}

SurfaceTopology analyse_topology(const std::vector<Triangle>& triangles) {
  const std::vector<EdgeUse> uses = sorted_edge_uses(triangles);
  WoundSets components(triangles.size()), patches(triangles.size());
  for_each_edge(uses, [&](std::size_t first, std::size_t count) {
    for (std::size_t i = 1; i < count; ++i)
      components.join(uses[first].triangle, uses[first + i].triangle, false);
    if (count != 2) return;
    const EdgeUse &a = uses[first], &b = uses[first + 1];
    patches.join(a.triangle, b.triangle, a.forward == b.forward);
  });

  SurfaceTopology topology;
  topology.component = components.labels(topology.component_count);
  topology.patch = patches.labels(topology.patch_count);
  topology.flipped.resize(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) topology.flipped[t] = patches.flipped(t);
  topology.edges.resize(topology.component_count);
  for_each_edge(uses, [&](std::size_t first, std::size_t count) {
    const EdgeUse& a = uses[first];
    SurfaceTopology::EdgeCount& edges = topology.edges[topology.component[a.triangle]];
    if (count == 1) {
      ++edges.open;
    } else if (count > 2) {
      ++edges.nonmanifold;
    } else {
      const EdgeUse& b = uses[first + 1];
      const bool a_forward = a.forward != topology.flipped[a.triangle];
      const bool b_forward = b.forward != topology.flipped[b.triangle];
      edges.twisted += a_forward == b_forward;
    }
  });
  return topology;
}

}  // namespace brachy
