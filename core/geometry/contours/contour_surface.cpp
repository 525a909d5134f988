#include "core/geometry/contours/contour_surface.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/geometry/contours/slice_distance.h"
#include "core/geometry/label_map/surface_nets.h"
#include "core/geometry/surface/surface_volume.h"

namespace brachy {
namespace {

/// A layer of the grid: between two planes, or in a slab's end.
struct GridLayer {
  double height_mm;
  std::size_t plane;  ///< the plane below, or at it
  double share;       ///< of the plane above, 0 … 1
  bool is_end;        ///< one of the two about the flat end of a slab
  bool is_outside;    ///< the one beyond it
};

constexpr double kEndMm = 0.02;  // half the distance of the two layers about the flat end of a slab

/// How far the slab of a piece's first or last plane reaches beyond it.
double half_slab(const ContourStack& stack, std::size_t plane, bool towards_next) {
  const double spacing = stack.spacing_mm > 0 ? stack.spacing_mm : 1;
  const bool has_neighbour =
      towards_next ? plane > 0 && !stack.is_piece_end(plane - 1) : !stack.is_piece_end(plane);
  if (!has_neighbour) return 0.5 * spacing;
  const std::size_t low = towards_next ? plane - 1 : plane;
  return 0.5 * std::min(spacing, stack.gap_mm(low));
}

void add_end(std::vector<GridLayer>& layers, const ContourStack& stack, std::size_t plane,
             bool towards_next) {
  const double reach = half_slab(stack, plane, towards_next), sign = towards_next ? 1 : -1;
  const double from = stack.planes[plane].height_mm;
  for (const double beyond : {-kEndMm, kEndMm}) {
    // A slab that is thinner than the two layers apart keeps the order.
    const double at = std::max(reach + beyond, 0.25 * reach * (beyond < 0 ? 1 : 2));
    layers.push_back({from + sign * at, plane, 0, true, beyond > 0});
  }
  if (!towards_next) std::swap(layers[layers.size() - 1], layers[layers.size() - 2]);
}

std::vector<GridLayer> layers_of(const ContourStack& stack, double pitch_mm) {
  std::vector<GridLayer> layers;
  for (std::size_t p = 0; p < stack.planes.size(); ++p) {
    if (p == 0 || stack.is_piece_end(p - 1)) add_end(layers, stack, p, false);
    layers.push_back({stack.planes[p].height_mm, p, 0, false, false});
    if (stack.is_piece_end(p)) {
      add_end(layers, stack, p, true);
      continue;
    }
    const double gap = stack.gap_mm(p);
    const auto steps = static_cast<std::size_t>(std::ceil(gap / pitch_mm - 1e-6));
    for (std::size_t s = 1; s < steps; ++s) {
      const double share = static_cast<double>(s) / static_cast<double>(steps);
      layers.push_back({stack.planes[p].height_mm + share * gap, p, share, false, false});
    }
  }
  return layers;
}

struct PlaneBox {
  Vec2 min = Vec2::Constant(1e300), max = Vec2::Constant(-1e300);
};

PlaneBox box_of(const ContourStack& stack) {
  PlaneBox box;
  for (const ContourPlane& plane : stack.planes)
    for (const Polygon& polygon : plane.polygons)
      for (const Vec2& p : polygon) {
        box.min = box.min.cwiseMin(p);
        box.max = box.max.cwiseMax(p);
      }
  return box;
}

/// Distances of the planes, computed as the layers come to them.
class PlaneDistances {
 public:
  PlaneDistances(const ContourStack& stack, const SliceGrid& grid) : stack_(stack), grid_(grid) {}

  const std::vector<float>& of(std::size_t plane) {
    for (Slot& slot : slots_)
      if (slot.plane == plane + 1) return slot.distance;
    Slot& oldest = slots_[0].plane < slots_[1].plane ? slots_[0] : slots_[1];
    oldest = {plane + 1, slice_distance(stack_.planes[plane].polygons, grid_)};
    return oldest.distance;
  }

 private:
  struct Slot {
    std::size_t plane = 0;  // + 1
    std::vector<float> distance;
  };
  const ContourStack& stack_;
  const SliceGrid& grid_;
  std::array<Slot, 2> slots_;
};

double slabs_mm3(const ContourStack& stack) {
  double sum = 0;
  for (std::size_t p = 0; p < stack.planes.size(); ++p) {
    const double below =
        p == 0 || stack.is_piece_end(p - 1) ? half_slab(stack, p, false) : 0.5 * stack.gap_mm(p - 1);
    const double above = stack.is_piece_end(p) ? half_slab(stack, p, true) : 0.5 * stack.gap_mm(p);
    sum += (below + above) * area_mm2(stack.planes[p].polygons);
  }
  return sum;
}

}  // namespace

ContourSurface contour_surface(const ContourStack& stack, const std::string& name,
                               const ContourSurfaceOptions& options) {
  const PlaneBox box = box_of(stack);
  const Vec2 extent = box.max - box.min;
  ContourSurface result;
  result.pitch_mm = options.pitch_mm > 0 ? options.pitch_mm : std::clamp(extent.minCoeff() / 40, 0.15, 1.0);
  const std::vector<GridLayer> layers = layers_of(stack, result.pitch_mm);
  SliceGrid grid{box.min - Vec2::Constant(1.37 * result.pitch_mm), result.pitch_mm, {}};
  const Vec2 steps = extent / result.pitch_mm + Vec2::Constant(3.74);
  if (!(steps.x() * steps.y() * static_cast<double>(layers.size()) <=
        static_cast<double>(options.most_nodes)))
    throw UserError(name + ": the contours span " + std::to_string(static_cast<long long>(extent.x())) +
                    " × " + std::to_string(static_cast<long long>(extent.y())) +
                    " mm in too many planes; crop them, or leave the structure out");
  grid.size = {static_cast<std::size_t>(std::ceil(steps.x())),
               static_cast<std::size_t>(std::ceil(steps.y()))};

  PlaneDistances distances(stack, grid);
  NetSurface net = surface_nets(
      {grid.size[0], grid.size[1], layers.size()},
      [&](std::size_t k, std::span<float> values) {
        const GridLayer& layer = layers[k];
        const std::vector<float>& below = distances.of(layer.plane);
        if (layer.share > 0) {
          const std::vector<float>& above = distances.of(layer.plane + 1);
          const auto share = static_cast<float>(layer.share);
          for (std::size_t n = 0; n < values.size(); ++n)
            values[n] = (1 - share) * below[n] + share * above[n];
        } else {
          std::ranges::copy(below, values.begin());
        }
        if (layer.is_outside) std::ranges::fill(values, 1.0F);
      },
      1.0F);
  // From grid indices to the world; layers are not evenly spaced.
  for (std::size_t n = 0; n < net.mesh.vertices.size(); ++n) {
    Vec3& v = net.mesh.vertices[n];
    // The end of a slab is flat, wherever its distance passes through 0.
    const auto cell = static_cast<std::size_t>(std::max(net.cells[n][2], 0));
    if (layers[cell].is_end && layers[cell + 1].is_end) v.z() = static_cast<double>(cell) + 0.5;
    const double k = std::clamp(v.z(), 0.0, static_cast<double>(layers.size() - 1));
    const auto low = std::min(static_cast<std::size_t>(k), layers.size() - 2);
    const double share = k - static_cast<double>(low);
    const double height = (1 - share) * layers[low].height_mm + share * layers[low + 1].height_mm;
    v = stack.position(grid.origin + result.pitch_mm * v.head<2>(), height);
  }
  result.mesh = std::move(net.mesh);
  result.slabs_cc = 1e-3 * slabs_mm3(stack);
  result.surface_cc = 1e-3 * enclosed_mm3(result.mesh);
  return result;
}

}  // namespace brachy
