#include "core/brachytherapy/plan/gland_holes.h"

#include <array>
#include <cmath>
#include <optional>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kStepMm = 0.5;  // along a needle, between the points where distances are measured

class UrethraDistance {
 public:
  explicit UrethraDistance(const std::vector<Structure>& structures, const SurfaceBvh& gland)
      : middle_(0.5 * (gland.min() + gland.max())) {
    if (const Structure* urethra = find_structure(structures, "urethra")) surface_.emplace(urethra->mesh);
  }
  double operator()(const Vec3& p) const {
    if (surface_) return surface_->closest_point(p).signed_distance;
    return (p - middle_).head<2>().norm() - kRadiusMm;
  }

 private:
  static constexpr double kRadiusMm = 3;
  Vec3 middle_;
  std::optional<SurfaceBvh> surface_;
};

std::optional<GlandHole> find_hole(const SurfaceBvh& gland, const UrethraDistance& urethra,
                                   const Vec3& hole) {
  const auto at = [&](double z) { return Vec3(hole.x(), hole.y(), z); };
  std::array<SurfaceHit, 32> hits;
  const std::size_t count = gland.all_hits(at(gland.min().z() - 1), at(gland.max().z() + 1), hits);
  if (count < 2) return {};
  const double near = hits[0].point.z(), far = hits[count - 1].point.z();
  GlandHole found{{}, hole, near - hole.z(), far - hole.z(), 0, urethra(at(far))};
  const int steps = static_cast<int>((far - near) / kStepMm);
  for (int i = 0; i <= steps; ++i) {
    const double z = near + kStepMm * i;
    found.depth_mm = std::max(found.depth_mm, -gland.closest_point(at(z)).signed_distance);
    found.urethra_mm = std::min(found.urethra_mm, urethra(at(z)));
  }
  return found;
}

[[noreturn]] void refuse_place(const SurfaceBvh& gland, const TemplateGrid& grid, const char* what) {
  constexpr double kBeforeMm = 40;
  const Vec3 middle = 0.5 * (gland.min() + gland.max());
  const Vec3 origin(std::round(middle.x() - 0.5 * grid.spacing_mm * (grid.columns - 1)),
                    std::round(middle.y() - 0.5 * grid.spacing_mm * (grid.rows - 1)),
                    std::round(gland.min().z() - kBeforeMm));
  throw UserError(std::string("the template ") + what + "; set template.origin_mm = [" + text_of(origin.x()) +
                  ", " + text_of(origin.y()) + ", " + text_of(origin.z()) + "]");
}

}  // namespace

std::vector<GlandHole> find_gland_holes(const std::vector<Structure>& structures, const TemplateGrid& grid) {
  const SurfaceBvh gland(structures.front().mesh);
  const UrethraDistance urethra(structures, gland);
  if (gland.min().z() <= grid.origin_mm.z()) refuse_place(gland, grid, "is not in front of the gland");
  std::vector<GlandHole> holes;
  for (int column = 0; column < grid.columns; ++column)
    for (int row = 0; row < grid.rows; ++row)
      if (auto hole = find_hole(gland, urethra, grid.position(column, row))) {
        hole->name = grid.name(column, row);
        holes.push_back(*hole);
      }
  if (holes.empty()) refuse_place(gland, grid, "is beside the gland: no needle would reach it");
  return holes;
}

}  // namespace brachy
