#include "core/brachytherapy/plan/optimiser/plan_points.h"

#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/surface/surface_volume.h"
#include "core/geometry/tissue/interior_points.h"

namespace brachy {
namespace {

constexpr double kAroundGlandMm = 8;
constexpr std::size_t kProbePoints = 4096;  // that show how much of a structure is near

struct NearBox {
  Vec3 min, max;
  bool contains(const Vec3& p) const {
    return (p.array() >= min.array()).all() && (p.array() <= max.array()).all();
  }
};

void append(PlanPoints& all, const std::string& name, const std::vector<Vec3>& points, double volume) {
  if (points.empty()) return;
  PlanPoints::Part part{name, all.points.size(), points.size(), volume};
  all.points.insert(all.points.end(), points.begin(), points.end());
  all.points.resize(part.first + part.padded(), points.back());
  all.parts.push_back(std::move(part));
}

/// About `count` points of the part of the structure within the box, and its volume.
void append_near(PlanPoints& all, const Structure& structure, const NearBox& box, std::size_t count) {
  const SurfaceBvh surface(structure.mesh);
  std::size_t near = 0;
  for (const Vec3& p : fill_interior(surface, kProbePoints, 1, structure.name)) near += box.contains(p);
  if (near == 0) return;
  const std::size_t whole = count * kProbePoints / near;
  std::vector<Vec3> chosen;
  const std::vector<Vec3> candidates = fill_interior(surface, whole, 1, structure.name);
  for (const Vec3& p : candidates)
    if (box.contains(p)) chosen.push_back(p);
  append(all, structure.name, chosen,
         1e-3 * enclosed_mm3(structure.mesh) * static_cast<double>(chosen.size()) /
             static_cast<double>(candidates.size()));
}

}  // namespace

PlanPoints plan_points(const std::vector<Structure>& structures, const PlanPointCounts& counts) {
  PlanPoints all;
  const Structure& gland = structures.front();
  const SurfaceBvh surface(gland.mesh);
  const NearBox near{surface.min() - Vec3::Constant(kAroundGlandMm),
                     surface.max() + Vec3::Constant(kAroundGlandMm)};
  append(all, gland.name, fill_interior(surface, counts.gland, 1, gland.name),
         1e-3 * enclosed_mm3(gland.mesh));
  for (std::size_t s = 1; s < structures.size(); ++s) {
    const Structure& structure = structures[s];
    if (structure.name == "pubic_arch") continue;
    append_near(all, structure, near,
                structure.name == "urethra"  ? counts.urethra
                : structure.name == "rectum" ? counts.rectum
                                             : counts.other);
  }
  return all;
}

}  // namespace brachy
