#include "apps/score/consequences.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "apps/score/spread.h"
#include "core/brachytherapy/dose/structure_voxels.h"

namespace brachy {
namespace {

struct Figures {
  double d90 = kNoNumber, v100 = kNoNumber, urethra_d30 = kNoNumber, rectum_d2cc = kNoNumber;
};

Figures figures_of(const std::vector<StructureDose>& structures) {
  Figures f;
  for (const StructureDose& s : structures) {
    if (s.name == "prostate") {
      f.d90 = s.d90_gy;
      f.v100 = s.v100_percent;
    }
    if (s.name == "urethra") f.urethra_d30 = s.d30_gy;
    if (s.name == "rectum") f.rectum_d2cc = s.d2cc_gy;
  }
  return f;
}

DoseChange change(const Figures& from, const Figures& to) {
  return {to.d90 - from.d90, to.v100 - from.v100, to.urethra_d30 - from.urethra_d30,
          to.rectum_d2cc - from.rectum_d2cc};
}

DoseSeed taken_out(DoseSeed seed) {
  seed.air_kerma_strength_u = -seed.air_kerma_strength_u;
  return seed;
}

/// Calls visit(dose, place, cc) for each part of a structure.
template <class Visit>
void visit_parts(const StructureVoxels& voxels, const DoseGrid& grid, const Visit& visit) {
  const auto [nx, ny, nz] = grid.size();
  const double cc = std::pow(grid.spacing_mm(), 3) / 1000;
  for (const std::uint32_t i : voxels.whole)
    visit(static_cast<double>(grid.dose_gy()[i]), grid.position(i % nx, i / nx % ny, i / (nx * ny)), cc);
  for (const StructureVoxels::Part& part : voxels.parts)
    visit(grid.at(part.centre), part.centre, part.volume_mm3 / 1000);
}

std::vector<Sector> sectors_of(const SurfaceMesh& prostate, const StructureVoxels& voxels,
                               const DoseGrid& grid, double prescription_gy) {
  Vec3 least = prostate.vertices.front(), most = least;
  for (const Vec3& v : prostate.vertices) {
    least = least.cwiseMin(v);
    most = most.cwiseMax(v);
  }
  const Vec3 middle = 0.5 * (least + most), size = most - least;
  std::vector<Sector> sectors;
  for (const char* level : {"base", "mid", "apex"})
    for (const char* front : {"anterior", "posterior"})
      for (const char* side : {"left", "right"})
        sectors.push_back({.name = std::string(level) + " " + front + " " + side,
                           .coldest_gy = std::numeric_limits<double>::infinity()});
  visit_parts(voxels, grid, [&](double gy, const Vec3& p, double cc) {
    const double up = (p.z() - least.z()) / size.z();
    const std::size_t level = up > 2.0 / 3 ? 0 : up > 1.0 / 3 ? 1 : 2;
    // RAS: +x is the patient's right, +y anterior.
    Sector& sector = sectors[4 * level + (p.y() > middle.y() ? 0 : 2) + (p.x() < middle.x() ? 0 : 1)];
    sector.volume_cc += cc;
    if (gy < prescription_gy) sector.cold_cc += cc;
    if (gy < sector.coldest_gy) {
      sector.coldest_gy = gy;
      sector.coldest = p;
    }
  });
  return sectors;
}

HotSpot hot_spot_of(const StructureVoxels& voxels, const DoseGrid& grid, double prescription_gy) {
  HotSpot spot;
  visit_parts(voxels, grid, [&](double gy, const Vec3& p, double cc) {
    if (gy > 1.5 * prescription_gy) spot.over_150_cc += cc;
    if (gy <= spot.gy) return;
    spot.gy = gy;
    spot.at = p;
  });
  return spot;
}

}  // namespace

double DoseChange::harm_percent(double prescription_gy) const {
  const auto too_much = [](double v) { return std::isfinite(v) ? std::max(0.0, v) : 0.0; };
  return too_much(-v100_percent) +
         100 / prescription_gy * (too_much(-d90_gy) + too_much(urethra_d30_gy) + too_much(rectum_d2cc_gy));
}

DoseChange dose_change(const std::vector<StructureDose>& from, const std::vector<StructureDose>& to) {
  return change(figures_of(from), figures_of(to));
}

std::string cost_text(const DoseChange& cost) {
  std::string told;
  const auto tell = [&](const char* what, double by, const char* unit, double least) {
    if (std::abs(by) >= least)
      told += fmt::format("{}{} {:+.1f} {}", told.empty() ? "" : ", ", what, by, unit);
  };
  tell("V100", cost.v100_percent, "points", 0.1);
  tell("D90", cost.d90_gy, "Gy", 0.5);
  tell("urethra D30", cost.urethra_d30_gy, "Gy", 1);
  tell("rectum D2cc", cost.rectum_d2cc_gy, "Gy", 1);
  return told.empty() ? "" : " (" + told + ")";
}

NeedleCosts::NeedleCosts(const Plan& plan, const TemplateGrid& grid, const ImplantDose& at_rest,
                         const std::vector<Seed>& seeds)
    : at_rest_(at_rest),
      as_is_(at_rest.evaluate()),
      fallen_(plan.needles.size()),
      wanted_(plan.needles.size()) {
  const std::vector<PlannedSeed> planned = plan.seeds(grid);
  for (const PlannedSeed& seed : planned) wanted_[seed.needle].push_back(seed);
  for (const Seed& seed : seeds)
    (seed.planned < 0 ? unplanned_ : fallen_[planned[static_cast<std::size_t>(seed.planned)].needle])
        .push_back(seed.at_rest());
}

DoseChange NeedleCosts::against(std::span<const DoseSeed> taken, std::span<const DoseSeed> given) const {
  ImplantDose dose = at_rest_;
  for (const DoseSeed& seed : taken) dose.add(taken_out(seed));
  for (const DoseSeed& seed : given) dose.add(seed);
  return change(figures_of(dose.evaluate()), figures_of(as_is_));
}

DoseChange NeedleCosts::of(std::span<const std::size_t> needles) const {
  std::vector<DoseSeed> taken, given;
  for (const std::size_t n : needles) {
    taken.insert(taken.end(), fallen_[n].begin(), fallen_[n].end());
    given.insert(given.end(), wanted_[n].begin(), wanted_[n].end());
  }
  return against(taken, given);
}

DoseChange NeedleCosts::of_unplanned() const {
  return unplanned_.empty() ? DoseChange{} : against(unplanned_, {});
}

DoseChange NeedleCosts::of_all(const std::vector<StructureDose>& planned) const {
  return change(figures_of(planned), figures_of(as_is_));
}

Consequences find_consequences(const NeedleCosts& costs, const Plan& plan, const ImplantDose& at_rest,
                               const std::vector<StructureDose>& planned) {
  const std::vector<Structure>& structures = at_rest.structures();
  Consequences all;
  all.whole = costs.of_all(planned);
  all.sectors =
      sectors_of(structures.front().mesh, at_rest.voxels().front(), at_rest.grid(), plan.prescription_gy);
  if (const Structure* urethra = find_structure(structures, "urethra"))
    all.urethra = hot_spot_of(at_rest.voxels()[static_cast<std::size_t>(urethra - structures.data())],
                              at_rest.grid(), plan.prescription_gy);
  for (std::size_t n = 0; n < plan.needles.size(); ++n) all.needles.push_back({n, costs.of({&n, 1})});
  all.unplanned = costs.of_unplanned();
  return all;
}

}  // namespace brachy
