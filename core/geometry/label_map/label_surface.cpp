#include "core/geometry/label_map/label_surface.h"

#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/geometry/label_map/surface_nets.h"
#include "core/geometry/surface/surface_volume.h"

namespace brachy {
namespace {

/// The part of the grid that a value takes.
struct LabelBox {
  std::array<std::size_t, 3> min, max;  ///< inclusive
  std::size_t voxels = 0;
};

LabelBox box_of(const VoxelGrid& grid, std::span<const std::uint16_t> labels, std::uint16_t value) {
  LabelBox box{grid.size, {0, 0, 0}};
  const auto [nx, ny, nz] = grid.size;
  for (std::size_t k = 0; k < nz; ++k)
    for (std::size_t j = 0; j < ny; ++j) {
      const auto row = labels.subspan(grid.index(0, j, k), nx);
      const auto first = std::ranges::find(row, value);
      if (first == row.end()) continue;
      std::size_t last = 0;
      for (std::size_t i = static_cast<std::size_t>(first - row.begin()); i < nx; ++i)
        if (row[i] == value) {
          ++box.voxels;
          last = i;
        }
      const std::array<std::size_t, 3> low{static_cast<std::size_t>(first - row.begin()), j, k},
          high{last, j, k};
      for (std::size_t a = 0; a < 3; ++a) {
        box.min[a] = std::min(box.min[a], low[a]);
        box.max[a] = std::max(box.max[a], high[a]);
      }
    }
  return box;
}

/// Vertices that share an edge with each vertex, as ranges of one list.
struct NetNeighbours {
  std::vector<std::uint32_t> begin, all;

  NetNeighbours(const std::vector<Triangle>& triangles, std::size_t vertices) : begin(vertices + 1, 0) {
    // Each edge has two triangles wound alike: as a directed edge it occurs once.
    for (const Triangle& t : triangles)
      for (const std::uint32_t v : t) ++begin[v + 1];
    for (std::size_t v = 0; v < vertices; ++v) begin[v + 1] += begin[v];
    all.resize(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (const Triangle& t : triangles)
      for (std::size_t n = 0; n < 3; ++n) all[next[t[n]]++] = t[(n + 1) % 3];
  }
};

constexpr double kMostOff = 0.25;  // voxels

/// The mean place of the label's voxels, in voxels from the box's first one.
Vec3 middle_of(const VoxelGrid& grid, std::span<const std::uint16_t> labels, std::uint16_t value,
               const LabelBox& box) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = box.min[2]; k <= box.max[2]; ++k)
    for (std::size_t j = box.min[1]; j <= box.max[1]; ++j)
      for (std::size_t i = box.min[0]; i <= box.max[0]; ++i)
        if (labels[grid.index(i, j, k)] == value)
          sum += Vec3(static_cast<double>(i - box.min[0]), static_cast<double>(j - box.min[1]),
                      static_cast<double>(k - box.min[2]));
  return sum / static_cast<double>(box.voxels);
}

void smooth(NetSurface& net, int steps) {
  const NetNeighbours neighbours(net.mesh.triangles, net.mesh.vertices.size());
  std::vector<Vec3>& vertices = net.mesh.vertices;
  std::vector<Vec3> moved(vertices.size());
  for (int step = 0; step < steps; ++step) {
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      Vec3 mean = Vec3::Zero();
      const std::uint32_t begin = neighbours.begin[v], end = neighbours.begin[v + 1];
      for (std::uint32_t n = begin; n < end; ++n) mean += vertices[neighbours.all[n]];
      mean /= std::max(1u, end - begin);
      // A little within the cell, so that vertices of neighbouring cells never coincide.
      const Vec3 low = Vec3(net.cells[v][0], net.cells[v][1], net.cells[v][2]).array() + 0.02;
      moved[v] = (0.5 * (vertices[v] + mean)).cwiseMax(low).cwiseMin(low + Vec3::Constant(0.96));
    }
    vertices.swap(moved);
  }
}

}  // namespace

LabelSurface label_surface(const VoxelGrid& grid, std::span<const std::uint16_t> labels, std::uint16_t value,
                           const LabelSurfaceOptions& options) {
  const LabelBox box = box_of(grid, labels, value);
  if (box.voxels == 0) throw UserError("no voxel has the label " + std::to_string(value));
  std::array<std::size_t, 3> size{};
  for (std::size_t a = 0; a < 3; ++a) size[a] = box.max[a] - box.min[a] + 1;
  const NetSurface stairs = surface_nets(
      size,
      [&](std::size_t k, std::span<float> layer) {
        for (std::size_t j = 0; j < size[1]; ++j)
          for (std::size_t i = 0; i < size[0]; ++i)
            layer[j * size[0] + i] =
                labels[grid.index(box.min[0] + i, box.min[1] + j, box.min[2] + k)] == value ? -0.5F : 0.5F;
      },
      0.5F, options.most_vertices);
  const Vec3 middle = middle_of(grid, labels, value, box);
  NetSurface net;
  Vec3 off = Vec3::Zero();
  // Smoothing takes more from where a structure is a voxel thinner, and what gives the whole its volume back would then
  // move its middle along it: what is thin is smoothed less.
  for (int steps = options.smoothing_steps;; steps /= 2) {
    net = stairs;
    smooth(net, steps);
    // In voxels, so that long ones grow along their length. Along a corner's normal a whole step is 0.58 along each
    // axis: a voxel by itself gets its volume back.
    move_to_volume(net.mesh, static_cast<double>(box.voxels), 1);
    off = middle - enclosed_centroid(net.mesh);
    if (off.norm() <= kMostOff || steps == 0) break;
  }
  for (Vec3& v : net.mesh.vertices) v += off;
  LabelSurface result{std::move(net.mesh), 1e-3 * grid.voxel_mm3() * static_cast<double>(box.voxels), 0,
                      box.voxels};
  const auto first =
      Vec3(static_cast<double>(box.min[0]), static_cast<double>(box.min[1]), static_cast<double>(box.min[2]));
  for (Vec3& v : result.mesh.vertices) v = grid.position(first + v);
  if (grid.steps.determinant() < 0)
    for (Triangle& t : result.mesh.triangles) std::swap(t[1], t[2]);
  result.surface_cc = 1e-3 * enclosed_mm3(result.mesh);
  return result;
}

}  // namespace brachy
