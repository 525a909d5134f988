#include "core/brachytherapy/dose/implant_dose.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/dose/swelling_phases.h"

namespace brachy {
namespace {

DoseGrid grid_about(const std::vector<Structure>& structures, const DoseSettings& settings) {
  if (structures.empty())
    throw UserError("dose needs a structure around which to place its grid; give the scene a tissue");
  const auto named = std::find_if(structures.begin(), structures.end(),
                                  [](const Structure& s) { return s.name == "prostate"; });
  const Structure& target = named == structures.end() ? structures.front() : *named;
  if (target.mesh.vertices.empty()) throw UserError("structure \"" + target.name + "\" has no vertices");
  Vec3 min = target.mesh.vertices.front(), max = min;
  for (const Vec3& v : target.mesh.vertices) {
    min = min.cwiseMin(v);
    max = max.cwiseMax(v);
  }
  const Vec3 margin = Vec3::Constant(settings.margin_mm);
  return {min - margin, max + margin, settings.spacing_mm};
}

}  // namespace

ImplantDose::ImplantDose(std::vector<Structure> structures, const DoseSettings& settings)
    : structures_(std::move(structures)), settings_(settings), grid_(grid_about(structures_, settings)) {
  for (const Structure& structure : structures_)
    voxels_.push_back(structure_voxels(SurfaceBvh(structure.mesh), grid_));
}

void ImplantDose::add(const DoseSeed& seed, const Vec3& stretch) {
  grid_.add(seed, stretch);
  ++seed_count_;
}

void ImplantDose::add_while_swollen(const DoseSeed& seed, const Vec3& day_zero_stretch,
                                    double resolved_days) {
  const double half_life = tg43_source(seed.source).half_life_days;
  for (const SwellingPhase& phase : resolving_swelling(half_life, day_zero_stretch, resolved_days)) {
    DoseSeed of_phase = seed;
    of_phase.air_kerma_strength_u *= phase.share;
    grid_.add(of_phase, phase.stretch);
  }
  ++seed_count_;
}

void ImplantDose::clear() {
  grid_.clear();
  seed_count_ = 0;
}

std::vector<StructureDose> ImplantDose::evaluate() const {
  std::vector<StructureDose> doses;
  doses.reserve(structures_.size());
  for (std::size_t i = 0; i < structures_.size(); ++i)
    doses.push_back(structure_dose(structures_[i].name, voxels_[i], grid_, settings_.prescription_gy));
  return doses;
}

}  // namespace brachy
