#include "apps/score/structure_contact.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/geometry/surface/surface_bvh.h"
#include "haptics/trajectory/needle_metrics.h"

namespace brachy {
namespace {

bool is_in_box(const SurfaceBvh& surface, const Vec3& p) {
  return (p.array() >= surface.min().array()).all() && (p.array() <= surface.max().array()).all();
}

constexpr double kDrawnBackMm = 1;

/// Whether the tip was drawn back behind `entry` in these samples.
bool is_drawn_back(std::span<const TrajectorySample> samples, const RigidTransform& entry) {
  return std::ranges::any_of(samples, [&](const TrajectorySample& sample) {
    return (sample.X_WN.p - entry.p).dot(entry.R.col(2)) < -kDrawnBackMm;
  });
}

}  // namespace

std::vector<StructureContact> structure_contacts(std::span<const Structure> structures,
                                                 const TemplateGrid& grid, const NeedleTrajectories& poses) {
  std::vector<StructureContact> all;
  for (const Structure& structure : structures) {
    const SurfaceBvh surface(structure.mesh);
    const auto first = static_cast<std::ptrdiff_t>(all.size());
    for (const auto& [id, motion] : poses.needles()) {
      const std::span<const TrajectorySample> samples = motion.samples();
      std::optional<RigidTransform> pass;  // where the present one began
      std::string pass_hole;
      std::size_t last_end = 0;
      for (const TissueVisit& visit : tissue_visits(
               samples, [&](const Vec3& p) { return is_in_box(surface, p) && surface.inside(p); })) {
        const RigidTransform& X_WN = samples[visit.first].X_WN;
        const std::string hole = grid.nearest(X_WN.p, X_WN.R.col(2)).value_or("");
        auto contact = std::ranges::find(all.begin() + first, all.end(), hole, &StructureContact::hole);
        if (contact == all.end()) contact = all.insert(all.end(), {structure.name, hole});
        const auto between = samples.subspan(last_end, visit.first - last_end);
        if (!pass || hole != pass_hole || is_drawn_back(between, *pass)) {
          pass = X_WN;
          pass_hole = hole;
          ++contact->passes;
        }
        contact->first_s = std::fmin(contact->first_s, samples[visit.first].t_s);
        last_end = visit.end;
        contact->time_s += visit.time_s;
        for (const TrajectorySample& sample : samples.subspan(visit.first, visit.end - visit.first))
          contact->depth_mm =
              std::max(contact->depth_mm, -surface.closest_point(sample.X_WN.p).signed_distance);
      }
    }
  }
  return all;
}

std::vector<StructureContact> structure_contacts(std::span<const Structure> structures,
                                                 const TemplateGrid& grid, std::span<const OrganPass> passes,
                                                 const NeedleTrajectories* poses) {
  std::vector<StructureContact> all;
  bool has_open = false;
  for (const Structure& structure : structures) {
    const auto first = static_cast<std::ptrdiff_t>(all.size());
    for (const OrganPass& pass : passes) {
      if (pass.organ != structure.name) continue;
      const std::string hole = grid.nearest(pass.entered_at, pass.axis).value_or("");
      auto contact = std::ranges::find(all.begin() + first, all.end(), hole, &StructureContact::hole);
      if (contact == all.end()) contact = all.insert(all.end(), {structure.name, hole});
      ++contact->passes;
      contact->depth_mm = std::max(contact->depth_mm, pass.depth_mm);
      contact->time_s += pass.time_s;
      contact->first_s = std::fmin(contact->first_s, pass.is_ended ? pass.t_s - pass.time_s : pass.t_s);
      has_open |= !pass.is_ended;
    }
  }
  if (!has_open || !poses) return all;
  for (const StructureContact& at_rest : structure_contacts(structures, grid, *poses))
    for (StructureContact& contact : all)
      if (contact.structure == at_rest.structure && contact.hole == at_rest.hole) {
        contact.depth_mm = std::max(contact.depth_mm, at_rest.depth_mm);
        contact.time_s = std::max(contact.time_s, at_rest.time_s);
      }
  return all;
}

}  // namespace brachy
