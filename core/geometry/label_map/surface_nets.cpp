#include "core/geometry/label_map/surface_nets.h"

#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/geometry/label_map/cell_sheets.h"

namespace brachy {
namespace {

/// Four vertices around a grid edge that the surface crosses, wound outward, and its inside node.
struct NetQuad {
  std::array<std::uint32_t, 4> corners;
  std::uint64_t inside_node;
};

/// An edge of a quad: from corner `n` to the next one.
struct QuadEdge {
  std::uint32_t low, high;
  std::uint32_t quad;
  std::uint32_t n;
};

class NetBuilder {
 public:
  NetBuilder(const std::array<std::size_t, 3>& size, float outside, std::size_t most_vertices)
      : nx_(size[0] + 2), ny_(size[1] + 2), most_vertices_(most_vertices) {
    for (auto& layer : layers_) layer.assign(nx_ * ny_, outside);
    for (auto& layer : first_) layer.assign(nx_ * ny_, 0);
    for (auto& layer : configurations_) layer.assign(nx_ * ny_, 0);
  }

  /// The next layer of nodes, with the border; the first one completes no cell.
  std::vector<float>& next_layer() {
    std::swap(layers_[0], layers_[1]);
    std::swap(first_[0], first_[1]);
    std::swap(configurations_[0], configurations_[1]);
    return layers_[1];
  }

  /// The cells between the last two layers; `k` is the lower one's index, from −1 on.
  void add_cells(std::int32_t k);

  NetSurface finish();

 private:
  std::size_t node(std::size_t i, std::size_t j) const { return j * nx_ + i; }
  void add_vertices(std::size_t i, std::size_t j, std::int32_t k, int configuration);
  void add_quads(std::size_t i, std::size_t j, std::int32_t k, int configuration);
  void split_shared_edges();
  void add_polygon(const std::vector<std::uint32_t>& corners);

  std::size_t nx_, ny_;
  std::size_t most_vertices_;
  std::array<std::vector<float>, 2> layers_;
  // Of the cells of the last two layers: their first vertex, and which corners are inside.
  std::array<std::vector<std::uint32_t>, 2> first_;
  std::array<std::vector<std::uint8_t>, 2> configurations_;
  std::vector<NetQuad> quads_;
  bool may_share_edges_ = false;
  NetSurface surface_;
};

void NetBuilder::add_cells(std::int32_t k) {
  for (std::size_t j = 0; j + 1 < ny_; ++j)
    for (std::size_t i = 0; i + 1 < nx_; ++i) {
      int configuration = 0;
      for (int c = 0; c < 8; ++c) {
        const auto x = i + (static_cast<std::size_t>(c) & 1), y = j + (static_cast<std::size_t>(c) >> 1 & 1);
        if (layers_[static_cast<std::size_t>(c) >> 2][node(x, y)] < 0) configuration |= 1 << c;
      }
      configurations_[1][node(i, j)] = static_cast<std::uint8_t>(configuration);
      if (configuration == 0 || configuration == 255) continue;
      add_vertices(i, j, k, configuration);
      add_quads(i, j, k, configuration);
    }
}

void NetBuilder::add_vertices(std::size_t i, std::size_t j, std::int32_t k, int configuration) {
  const CellSheets& sheets = cell_sheets()[static_cast<std::size_t>(configuration)];
  may_share_edges_ = may_share_edges_ || sheets.may_share_an_edge;
  first_[1][node(i, j)] = static_cast<std::uint32_t>(surface_.mesh.vertices.size());
  std::array<Vec3, 4> sums{Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  std::array<int, 4> counts{};
  for (int e = 0; e < 12; ++e) {
    const int sheet = sheets.of_edge[static_cast<std::size_t>(e)];
    if (sheet < 0) continue;
    const auto [low, high] = corners_of_edge(e);
    const auto value = [&](int c) {
      const auto bits = static_cast<std::size_t>(c);
      return double{layers_[bits >> 2][node(i + (bits & 1), j + (bits >> 1 & 1))]};
    };
    const double a = value(low), b = value(high);
    Vec3 p(low & 1, low >> 1 & 1, low >> 2);
    p[e / 4] += a / (a - b);
    sums[static_cast<std::size_t>(sheet)] += p;
    ++counts[static_cast<std::size_t>(sheet)];
  }
  const std::array<std::int32_t, 3> cell{static_cast<std::int32_t>(i) - 1, static_cast<std::int32_t>(j) - 1,
                                         k};
  for (std::size_t s = 0; s < static_cast<std::size_t>(sheets.count); ++s) {
    surface_.mesh.vertices.push_back(Vec3(cell[0], cell[1], cell[2]) + sums[s] / counts[s]);
    surface_.cells.push_back(cell);
  }
  if (surface_.mesh.vertices.size() > most_vertices_)
    throw UserError("the surface has more than " + std::to_string(most_vertices_) +
                    " vertices; crop the map or use larger voxels");
}

// A cell makes the quads about those of its edges of which it is the last of the four cells: the edges at its lowest
// corner.
void NetBuilder::add_quads(std::size_t i, std::size_t j, std::int32_t k, int configuration) {
  for (int a = 0; a < 3; ++a) {
    const bool low_inside = (configuration & 1) != 0, high_inside = (configuration >> (1 << a) & 1) != 0;
    if (low_inside == high_inside) continue;
    const int u = (a + 1) % 3, v = (a + 2) % 3;
    NetQuad quad{};
    // The cells around the edge in the order (0, 0), (−1, 0), (−1, −1), (0, −1) along u and v: counter-clockwise seen
    // from +a. In a cell that is shifted by −1 along u the edge lies at its upper u.
    for (std::size_t n = 0; n < 4; ++n) {
      const int du = n == 1 || n == 2 ? 1 : 0, dv = n >= 2 ? 1 : 0;
      std::array<std::size_t, 3> back{};
      back[static_cast<std::size_t>(u)] = static_cast<std::size_t>(du);
      back[static_cast<std::size_t>(v)] = static_cast<std::size_t>(dv);
      const std::size_t layer = 1 - back[2], at = node(i - back[0], j - back[1]);
      const auto edge = static_cast<std::size_t>(4 * a + du + 2 * dv);
      const auto& sheets = cell_sheets()[configurations_[layer][at]];
      quad.corners[n] = first_[layer][at] + static_cast<std::uint32_t>(sheets.of_edge[edge]);
    }
    if (!low_inside) std::swap(quad.corners[1], quad.corners[3]);
    std::array<std::size_t, 3> inside{i, j, static_cast<std::size_t>(k + 1)};
    if (!low_inside) ++inside[static_cast<std::size_t>(a)];
    quad.inside_node = (std::uint64_t{inside[2]} * ny_ + inside[1]) * nx_ + inside[0];
    quads_.push_back(quad);
  }
}

/// Two triangles along the shorter diagonal; more corners become a fan from their first one.
void NetBuilder::add_polygon(const std::vector<std::uint32_t>& corners) {
  const auto& v = surface_.mesh.vertices;
  std::size_t first = 0;
  if (corners.size() == 4 &&
      (v[corners[1]] - v[corners[3]]).squaredNorm() < (v[corners[0]] - v[corners[2]]).squaredNorm())
    first = 1;
  const std::size_t n = corners.size();
  for (std::size_t m = 1; m + 1 < n; ++m)
    surface_.mesh.triangles.push_back(
        {corners[first], corners[(first + m) % n], corners[(first + m + 1) % n]});
}

// An edge with four quads becomes two with a middle of their own, one for each inside node: quads of one inside node
// belong to one sheet.
void NetBuilder::split_shared_edges() {
  std::vector<QuadEdge> edges;
  edges.reserve(4 * quads_.size());
  for (std::uint32_t q = 0; q < quads_.size(); ++q)
    for (std::uint32_t n = 0; n < 4; ++n) {
      const std::uint32_t a = quads_[q].corners[n], b = quads_[q].corners[(n + 1) % 4];
      edges.push_back({std::min(a, b), std::max(a, b), q, n});
    }
  std::ranges::sort(edges, {}, [&](const QuadEdge& e) {
    return std::array<std::uint64_t, 3>{e.low, e.high, quads_[e.quad].inside_node};
  });
  std::vector<std::array<std::uint32_t, 4>> middles(quads_.size(), {0, 0, 0, 0});  // 0: none, else vertex + 1
  std::vector<bool> is_split(quads_.size(), false);
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
      ++end;
    if (end - begin <= 2) continue;
    for (std::size_t pair = begin; pair + 1 < end; pair += 2) {
      auto& vertices = surface_.mesh.vertices;
      // Towards the sheet's own quads, so that the two middles differ.
      Vec3 centre = Vec3::Zero();
      for (std::size_t e = pair; e < pair + 2; ++e)
        for (const std::uint32_t corner : quads_[edges[e].quad].corners) centre += vertices[corner] / 8;
      const Vec3 middle = 0.5 * (vertices[edges[pair].low] + vertices[edges[pair].high]);
      vertices.push_back(0.9 * middle + 0.1 * centre);
      surface_.cells.push_back(surface_.cells[edges[pair].low]);
      for (std::size_t e = pair; e < pair + 2; ++e) {
        middles[edges[e].quad][edges[e].n] = static_cast<std::uint32_t>(vertices.size());
        is_split[edges[e].quad] = true;
      }
    }
  }
  for (std::size_t q = 0; q < quads_.size(); ++q) {
    if (!is_split[q]) continue;
    // A fan from a middle: one from a corner could repeat the edge that was split.
    std::vector<std::uint32_t> corners;
    std::size_t first = 0;
    for (std::size_t n = 0; n < 4; ++n) {
      corners.push_back(quads_[q].corners[n]);
      if (middles[q][n] == 0) continue;
      first = corners.size();
      corners.push_back(middles[q][n] - 1);
    }
    std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(first), corners.end());
    for (std::size_t m = 1; m + 1 < corners.size(); ++m)
      surface_.mesh.triangles.push_back({corners[0], corners[m], corners[m + 1]});
  }
  std::size_t kept = 0;
  for (std::size_t q = 0; q < quads_.size(); ++q)
    if (!is_split[q]) quads_[kept++] = quads_[q];
  quads_.resize(kept);
}

NetSurface NetBuilder::finish() {
  surface_.mesh.triangles.reserve(2 * quads_.size());
  if (may_share_edges_) split_shared_edges();
  for (const NetQuad& quad : quads_) add_polygon({quad.corners.begin(), quad.corners.end()});
  return std::move(surface_);
}

}  // namespace

NetSurface surface_nets(const std::array<std::size_t, 3>& size,
                        const std::function<void(std::size_t k, std::span<float> layer)>& fill, float outside,
                        std::size_t most_vertices) {
  NetBuilder builder(size, outside, most_vertices);
  std::vector<float> inner(size[0] * size[1]);
  for (std::size_t k = 0; k <= size[2]; ++k) {
    std::vector<float>& layer = builder.next_layer();
    std::ranges::fill(layer, outside);
    if (k < size[2]) {
      fill(k, inner);
      for (std::size_t j = 0; j < size[1]; ++j)
        std::copy_n(inner.begin() + static_cast<std::ptrdiff_t>(j * size[0]), size[0],
                    layer.begin() + static_cast<std::ptrdiff_t>((j + 1) * (size[0] + 2) + 1));
    }
    builder.add_cells(static_cast<std::int32_t>(k) - 1);
  }
  return builder.finish();
}

}  // namespace brachy
