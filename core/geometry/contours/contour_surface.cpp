#include "core/geometry/contours/contour_surface.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/geometry/contours/contour_pieces.h"
#include "core/geometry/contours/slice_distance.h"
#include "core/geometry/label_map/surface_nets.h"
#include "core/geometry/surface/surface_volume.h"

namespace brachy {
namespace {

/// A layer of the grid: between two planes, or in a slab's end.
struct GridLayer {
  double height_mm;
  std::size_t plane;  ///< of the piece: the one below, or at it
  double share;       ///< of the plane above, 0 … 1
  bool is_end;        ///< one of the two about the flat end of a slab
  bool is_outside;    ///< the one beyond it
};

constexpr double kMostMovedMm = 0.2;
constexpr float kMostMovedBetweenMm = 1;  // of a layer between two planes
constexpr double kMostOffArea = 0.05;     // of a plane as the grid sees it
constexpr double kEndMm = 0.02;           // half the distance of the two layers about the flat end of a slab

double gap_mm(const ContourPiece& piece, std::size_t below) {
  return piece.planes[below + 1].height_mm - piece.planes[below].height_mm;
}

/// How far the slab of a piece's first or last plane reaches beyond it.
double half_slab(const ContourPiece& piece, double spacing_mm, bool is_last) {
  if (piece.planes.size() == 1) return 0.5 * spacing_mm;
  return 0.5 * std::min(spacing_mm, gap_mm(piece, is_last ? piece.planes.size() - 2 : 0));
}

void add_end(std::vector<GridLayer>& layers, const ContourPiece& piece, double spacing_mm, bool is_last) {
  const double reach = half_slab(piece, spacing_mm, is_last), sign = is_last ? 1 : -1;
  const std::size_t plane = is_last ? piece.planes.size() - 1 : 0;
  const double from = piece.planes[plane].height_mm;
  for (const double beyond : {-kEndMm, kEndMm}) {
    // A slab that is thinner than the two layers apart keeps the order.
    const double at = std::max(reach + beyond, 0.25 * reach * (beyond < 0 ? 1 : 2));
    layers.push_back({from + sign * at, plane, 0, true, beyond > 0});
  }
  if (!is_last) std::swap(layers[0], layers[1]);
}

/// Whether the piece has more area here than in the planes below and above.
bool is_widest(const ContourPiece& piece, std::size_t plane) {
  constexpr double kLeastGapMm = 0.2;
  if (plane == 0 || plane + 1 >= piece.planes.size()) return false;
  const double area = piece.planes[plane].area_mm2;
  return area >= piece.planes[plane - 1].area_mm2 && area >= piece.planes[plane + 1].area_mm2 &&
         std::min(gap_mm(piece, plane - 1), gap_mm(piece, plane)) > kLeastGapMm;
}

std::vector<GridLayer> layers_of(const ContourPiece& piece, double spacing_mm, double pitch_mm) {
  std::vector<GridLayer> layers;
  add_end(layers, piece, spacing_mm, false);
  for (std::size_t p = 0; p < piece.planes.size(); ++p) {
    if (is_widest(piece, p))  // the net's vertices lie between layers: two about a crest keep it
      for (const double beside : {-kEndMm, kEndMm})
        layers.push_back({piece.planes[p].height_mm + beside, p, 0, false, false});
    else
      layers.push_back({piece.planes[p].height_mm, p, 0, false, false});
    if (p + 1 == piece.planes.size()) break;
    const double gap = gap_mm(piece, p);
    const auto steps = static_cast<std::size_t>(std::ceil(gap / pitch_mm - 1e-6));
    for (std::size_t s = 1; s < steps; ++s) {
      const double share = static_cast<double>(s) / static_cast<double>(steps);
      layers.push_back({piece.planes[p].height_mm + share * gap, p, share, false, false});
    }
  }
  add_end(layers, piece, spacing_mm, true);
  return layers;
}

Vec2 offset_of(const ContourPiece& piece, const GridLayer& layer) {
  const Vec2& below = piece.planes[layer.plane].offset;
  if (layer.share == 0) return below;
  return (1 - layer.share) * below + layer.share * piece.planes[layer.plane + 1].offset;
}

Eigen::AlignedBox2d box_of(const ContourPiece& piece) {
  Eigen::AlignedBox2d box;
  for (const PiecePlane& plane : piece.planes)
    for (const Polygon& polygon : plane.polygons)
      for (const Vec2& p : polygon) box.extend(p);
  return box;
}

/// The part of a layer that is nearer than `level_mm` to the inside, in cells of the grid. Cells at the edge count by
/// their share, as the distance grows by about a pitch from cell to cell.
double cells_within(std::span<const float> distance, float level_mm, float pitch_mm) {
  double sum = 0;
  for (const float d : distance) sum += std::clamp(0.5F - (d - level_mm) / pitch_mm, 0.0F, 1.0F);
  return sum;
}

/// The level at which a layer has this area: 0 where it has it already, at most `most_mm` from 0.
float level_of_area(std::span<const float> distance, double cells, float pitch_mm, float most_mm) {
  constexpr double kNear = 1e-3;
  constexpr int kMostRounds = 12;
  float low = -most_mm, high = most_mm, level = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    const double missing = cells - cells_within(distance, level, pitch_mm);
    if (std::abs(missing) <= kNear * cells) break;
    (missing > 0 ? low : high) = level;
    level = 0.5F * (low + high);
  }
  return level;
}

/// Distances of the planes, computed as the layers come to them.
class PlaneDistances {
 public:
  PlaneDistances(const ContourPiece& piece, const SliceGrid& grid) : piece_(piece), grid_(grid) {}

  struct Slot {
    std::size_t plane = 0;  // + 1
    std::vector<float> distance;
    double cells = 0;  ///< inside
  };
  const Slot& of(std::size_t plane) {
    for (Slot& slot : slots_)
      if (slot.plane == plane + 1) return slot;
    Slot& oldest = slots_[0].plane < slots_[1].plane ? slots_[0] : slots_[1];
    oldest = {plane + 1, slice_distance(piece_.planes[plane].polygons, grid_), 0};
    const auto pitch = static_cast<float>(grid_.pitch_mm);
    oldest.cells = cells_within(oldest.distance, 0, pitch);
    // A contour that is smaller than the grid's cells may lie between its nodes.
    const double cells = piece_.planes[plane].area_mm2 / (grid_.pitch_mm * grid_.pitch_mm);
    if (std::abs(oldest.cells - cells) <= kMostOffArea * cells) return oldest;
    const float level = level_of_area(oldest.distance, cells, pitch, kMostMovedBetweenMm);
    for (float& distance : oldest.distance) distance -= level;
    oldest.cells = cells;
    return oldest;
  }

 private:
  const ContourPiece& piece_;
  const SliceGrid& grid_;
  std::array<Slot, 2> slots_;
};

double slabs_mm3(const ContourPiece& piece, double spacing_mm) {
  double sum = 0;
  for (std::size_t p = 0; p < piece.planes.size(); ++p) {
    const bool is_last = p + 1 == piece.planes.size();
    const double below = p == 0 ? half_slab(piece, spacing_mm, false) : 0.5 * gap_mm(piece, p - 1);
    const double above = is_last ? half_slab(piece, spacing_mm, true) : 0.5 * gap_mm(piece, p);
    sum += (below + above) * piece.planes[p].area_mm2;
  }
  return sum;
}

/// A fortieth of the piece across, and a tenth of what it is thick. A trunk has some 50,000 cells at its surface, which
/// is simplified to some thousand vertices.
double fitting_pitch(const ContourPiece& piece, double spacing_mm, const Vec2& extent) {
  constexpr double kLeastMm = 0.25, kMostMm = 1, kOfRadius = 0.2, kMostCells = 2e4;
  double area = 0, perimeter = 0;
  for (const PiecePlane& plane : piece.planes) {
    area += plane.area_mm2;
    perimeter += plane.perimeter_mm;
  }
  const double most = std::max(kMostMm, std::sqrt(perimeter * spacing_mm / kMostCells));
  return std::clamp(std::min(extent.minCoeff() / 40, kOfRadius * 2 * area / perimeter), kLeastMm, most);
}

/// Appends the closed surface of a piece.
void add_surface(const ContourPiece& piece, const SliceGrid& grid, const std::vector<GridLayer>& layers,
                 const ContourStack& stack, double spacing_mm, SurfaceMesh& mesh) {
  PlaneDistances distances(piece, grid);
  NetSurface net = surface_nets(
      {grid.size[0], grid.size[1], layers.size()},
      [&](std::size_t k, std::span<float> values) {
        const GridLayer& layer = layers[k];
        const PlaneDistances::Slot& below = distances.of(layer.plane);
        if (layer.share > 0) {
          const PlaneDistances::Slot& above = distances.of(layer.plane + 1);
          const auto share = static_cast<float>(layer.share);
          for (std::size_t n = 0; n < values.size(); ++n)
            values[n] = (1 - share) * below.distance[n] + share * above.distance[n];
          const double cells = (1 - layer.share) * below.cells + layer.share * above.cells;
          const float level =
              level_of_area(values, cells, static_cast<float>(grid.pitch_mm), kMostMovedBetweenMm);
          for (float& value : values) value -= level;
        } else {
          std::ranges::copy(below.distance, values.begin());
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
    const Vec2 offset =
        (1 - share) * offset_of(piece, layers[low]) + share * offset_of(piece, layers[low + 1]);
    v = stack.position(grid.origin + grid.pitch_mm * v.head<2>() + offset, height);
  }
  // What is linear between planes lacks a little of what swells there, and chords of what is thin.
  move_to_volume(net.mesh, slabs_mm3(piece, spacing_mm), kMostMovedMm);
  const auto begin = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), net.mesh.vertices.begin(), net.mesh.vertices.end());
  for (const Triangle& t : net.mesh.triangles) {
    mesh.triangles.push_back({t[0] + begin, t[1] + begin, t[2] + begin});
    if (piece.is_cavity) std::swap(mesh.triangles.back()[1], mesh.triangles.back()[2]);
  }
}

}  // namespace

ContourSurface contour_surface(const ContourStack& stack, const std::string& name) {
  constexpr double kMostNodes = 64e6;
  const double spacing = stack.spacing_mm > 0 ? stack.spacing_mm : 1;
  ContourSurface result;
  double nodes = 0;
  for (const ContourPiece& piece : contour_pieces(stack, name)) {
    const Eigen::AlignedBox2d box = box_of(piece);
    const double pitch = fitting_pitch(piece, spacing, box.sizes());
    const std::vector<GridLayer> layers = layers_of(piece, spacing, pitch);
    const Vec2 steps = box.sizes() / pitch + Vec2::Constant(3.74);
    nodes += steps.x() * steps.y() * static_cast<double>(layers.size());
    if (!(nodes <= kMostNodes))
      throw UserError(name + ": the contours span " +
                      std::to_string(static_cast<long long>(box.sizes().x())) + " × " +
                      std::to_string(static_cast<long long>(box.sizes().y())) +
                      " mm in too many planes; crop them, or leave the structure out");
    const SliceGrid grid{
        box.min() - Vec2::Constant(1.37 * pitch),
        pitch,
        {static_cast<std::size_t>(std::ceil(steps.x())), static_cast<std::size_t>(std::ceil(steps.y()))}};
    add_surface(piece, grid, layers, stack, spacing, result.mesh);
    result.slabs_cc += (piece.is_cavity ? -1e-3 : 1e-3) * slabs_mm3(piece, spacing);
  }
  result.surface_cc = 1e-3 * enclosed_mm3(result.mesh);
  return result;
}

}  // namespace brachy
