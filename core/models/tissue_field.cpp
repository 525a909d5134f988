#include "core/models/tissue_field.h"

#include <algorithm>
#include <cassert>

namespace brachy {

void TissueField::Landmarks::reserve(std::size_t capacity) {
  positions.reserve(capacity);
  spreads.reserve(capacity);
  compliance.reserve(capacity, capacity);
}

void TissueField::Landmarks::assign(std::span<const Vec3> new_positions,
                                    std::span<const LandmarkSpread> new_spreads,
                                    const LandmarkCompliance& new_compliance) noexcept {
  positions.assign(new_positions.begin(), new_positions.end());
  spreads.assign(positions.size(), {});
  std::ranges::copy(new_spreads.first(std::min(new_spreads.size(), positions.size())), spreads.begin());
  compliance = new_compliance;
  is_known = true;
}

TissueField::TissueField(const LandmarkOptions& options) : options_(options) {
  factorized_.reserve(options.max_landmarks);
  field_.reserve(options.max_landmarks);
  for (auto* v : {&displacements_, &weights_, &landmark_displacements_, &forces_, &unit_, &unit_forces_})
    v->reserve(options.max_landmarks);
}

bool TissueField::are(const Landmarks& set, std::span<const Vec3> positions,
                      std::span<const LandmarkSpread> spreads,
                      const LandmarkCompliance& compliance) const noexcept {
  if (!set.is_known || !std::ranges::equal(positions, set.positions)) return false;
  if (options_.gives_way && compliance != set.compliance) return false;
  if (!options_.uses_spreads) return true;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if ((i < spreads.size() ? spreads[i] : LandmarkSpread{}) != set.spreads[i]) return false;
  return true;
}

FactorStatus TissueField::factorize(std::span<const Vec3> positions, std::span<const LandmarkSpread> spreads,
                                    const LandmarkCompliance& compliance) noexcept {
  assert(options_.gives_way || compliance.is_empty());
  if (are(factorized_, positions, spreads, compliance)) return {};
  factorized_.is_known = false;
  double condition = 1;
  const FactorStatus status = do_factorize(positions, spreads, compliance, condition);
  if (!status) return status;
  factorized_.assign(positions, spreads, compliance);
  condition_ = condition;
  return {};
}

void TissueField::solve(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept {
  assert(factorized_.is_known && displacements.size() == factorized_.positions.size() &&
         forces.size() == displacements.size());
  do_solve(displacements, forces);
  for (Vec3& f : forces) f *= options_.force_scale;
}

void TissueField::axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                                  Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(factorized_.is_known && first + axes.size() <= factorized_.positions.size());
  do_project_inverse(first, axes, H);
  H *= options_.force_scale;
}

void TissueField::rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                                  std::span<double> stiffness) noexcept {
  assert(factorized_.is_known && group_of.size() == factorized_.positions.size() &&
         motions.size() == group_of.size());
  do_rigid_stiffness(group_of, motions, stiffness);
  for (double& k : stiffness) k *= options_.force_scale;
}

void TissueField::do_rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                                     std::span<double> stiffness) noexcept {
  unit_forces_.resize(group_of.size());
  for (std::size_t g = 0; g < stiffness.size(); ++g) {
    unit_.assign(group_of.size(), Vec3::Zero());
    for (std::size_t l = 0; l < group_of.size(); ++l)
      if (group_of[l] == g) unit_[l] = motions[l];
    do_solve(unit_, unit_forces_);
    stiffness[g] = 0;
    for (std::size_t l = 0; l < group_of.size(); ++l)
      if (group_of[l] == g) stiffness[g] += motions[l].dot(unit_forces_[l]);
  }
}

void TissueField::evaluate(std::span<const Vec3> displacements) noexcept {
  assert(factorized_.is_known && displacements.size() == factorized_.positions.size());
  const bool is_new_set = !are(field_, factorized_.positions, factorized_.spreads, factorized_.compliance);
  if (!is_new_set && std::ranges::equal(displacements, displacements_)) {
    evaluation_ = Evaluation::kIdle;
    return;
  }
  if (is_new_set) field_.assign(factorized_.positions, factorized_.spreads, factorized_.compliance);
  displacements_.assign(displacements.begin(), displacements.end());
  weights_.resize(displacements.size());
  evaluation_ = do_evaluate(is_new_set, weights_);
  landmark_displacements_ = displacements_;
  if (field_.compliance.is_empty()) return;
  forces_ = weights_;
  for (Vec3& f : forces_) f *= options_.force_scale;
  field_.compliance.subtract(forces_, landmark_displacements_);
}

FactorStatus TissueField::update(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                                 std::span<const LandmarkSpread> spreads,
                                 const LandmarkCompliance& compliance) noexcept {
  if (const FactorStatus status = factorize(positions, spreads, compliance); !status) return status;
  evaluate(displacements);
  return {};
}

void TissueField::rescale(double scale) noexcept {
  for (auto* vectors : {&weights_, &displacements_, &landmark_displacements_})
    for (Vec3& v : *vectors) v *= scale;
  do_rescale(scale);
}

void TissueField::save(StateWriter& writer) const {
  writer(displacements_, weights_, landmark_displacements_);
  do_save(writer);
}

void TissueField::restore(StateReader& reader) {
  reader(displacements_, weights_, landmark_displacements_);
  do_restore(reader);
}

double TissueField::total_force_n() const {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& w : weights_) sum += w;
  return options_.force_scale * sum.norm();
}

}  // namespace brachy
