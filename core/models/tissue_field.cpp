#include "core/models/tissue_field.h"

#include <cassert>

namespace brachy {

TissueField::TissueField(const LandmarkOptions& options) : options_(options) {
  for (auto* v :
       {&positions_, &displacements_, &weights_, &landmark_displacements_, &forces_, &unit_, &unit_forces_})
    v->reserve(options.max_landmarks);
}

TissueField::Key TissueField::key_of(const LandmarkSet& landmarks) const noexcept {
  const LandmarkSet::Revision& revision = landmarks.revision();
  return {revision.positions, options_.uses_spreads ? revision.spreads : 0,
          options_.gives_way ? revision.compliance : 0};
}

FactorStatus TissueField::factorize(const LandmarkSet& landmarks) noexcept {
  assert(landmarks.is_numbered());
  assert(options_.gives_way || landmarks.compliance.is_empty());
  const Key key = key_of(landmarks);
  if (key == factorized_) return {};
  factorized_ = {};
  double condition = 1;
  const FactorStatus status = do_factorize(landmarks, condition);
  if (!status) return status;
  factorized_ = key;
  factorized_count_ = landmarks.positions.size();
  condition_ = condition;
  return {};
}

void TissueField::solve(std::span<const Vec3> displacements, std::span<Vec3> forces) noexcept {
  assert(factorized_ != Key{} && displacements.size() == factorized_count_ &&
         forces.size() == displacements.size());
  do_solve(displacements, forces);
  for (Vec3& f : forces) f *= options_.force_scale;
}

void TissueField::axial_stiffness(std::size_t first, std::span<const Vec3> axes,
                                  Eigen::Ref<Eigen::MatrixXd> H) noexcept {
  assert(factorized_ != Key{} && first + axes.size() <= factorized_count_);
  do_project_inverse(first, axes, H);
  H *= options_.force_scale;
}

void TissueField::rigid_stiffness(std::span<const std::uint32_t> group_of, std::span<const Vec3> motions,
                                  std::span<double> stiffness) noexcept {
  assert(factorized_ != Key{} && group_of.size() == factorized_count_ && motions.size() == group_of.size());
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

void TissueField::evaluate(const LandmarkSet& landmarks) noexcept {
  assert(factorized_ != Key{} && key_of(landmarks) == factorized_);
  const bool is_new_set = field_ != factorized_;
  if (!is_new_set && landmarks.displacements == displacements_) {
    evaluation_ = Evaluation::kIdle;
    return;
  }
  if (is_new_set) positions_ = landmarks.positions;
  field_ = factorized_;
  displacements_ = landmarks.displacements;
  weights_.resize(displacements_.size());
  evaluation_ = do_evaluate(is_new_set, weights_);
  landmark_displacements_ = displacements_;
  if (landmarks.compliance.is_empty()) return;
  forces_ = weights_;
  for (Vec3& f : forces_) f *= options_.force_scale;
  landmarks.compliance.subtract(forces_, landmark_displacements_);
}

FactorStatus TissueField::update(const LandmarkSet& landmarks) noexcept {
  if (const FactorStatus status = factorize(landmarks); !status) return status;
  evaluate(landmarks);
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
