#include "core/needle/contact_solve.h"

#include <algorithm>

#include "core/solve/landmark_repair.h"

#include "core/models/step_flag.h"

namespace brachy {

ContactSolve::ContactSolve(std::size_t max_landmarks, double period_s)
    : solver_(max_landmarks), period_s_(period_s) {
  const auto n = static_cast<Eigen::Index>(max_landmarks);
  stiffness_.resize(n, n);
  for (auto* v : {&axes_, &reactions_, &groups_.directions, &groups_.motions, &relaxed_, &yielded_})
    v->reserve(max_landmarks);
  for (auto* v : {&along_, &across_, &groups_.stiffnesses}) v->reserve(max_landmarks + 1);
  groups_.of.reserve(max_landmarks);
  groups_.instruments.reserve(max_landmarks);
  owned_.reserve(max_landmarks);
  removed_.reserve(max_landmarks);
  for (auto* v : {&slip_.stuck, &slip_.low, &slip_.high, &slip_.slips, &slip_.axial})
    v->reserve(max_landmarks);
}

FactorStatus ContactSolve::solve(std::uint64_t tick, std::span<NeedleContact> needles, ProbeContact* probe,
                                 LandmarkSet& landmarks, TissueField& field, std::uint32_t& flags) noexcept {
  body_motion_.setZero();
  if (const FactorStatus status = factorize(landmarks, field, flags); !status) {
    for (NeedleContact& needle : needles)
      needle.landmarks().empty() ? needle.finish(tick, period_s_, 0, 0)
                                 : needle.finish_unsolved(tick, period_s_);
    if (probe) probe->skip();
    return status;
  }
  const auto clear = [](NeedleLandmark& landmark) {
    landmark.reaction_n.setZero();
    landmark.slip_mm = 0;
  };
  for (NeedleContact& needle : needles) std::ranges::for_each(needle.landmarks(), clear);
  if (probe) std::ranges::for_each(probe->landmarks(), clear);
  if (!landmarks.owners.empty()) find_slips(needles, probe, landmarks, field, flags);
  landmarks.settle();
  find_stiffnesses(needles, probe, landmarks, field);
  for (std::size_t n = 0; n < needles.size(); ++n) needles[n].finish(tick, period_s_, along_[n], across_[n]);
  if (probe) probe->finish(tick, along_.back());
  return {};
}

// Landmarks that are too close together to be solved are left out, with their spreads and owners.
FactorStatus ContactSolve::factorize(LandmarkSet& landmarks, TissueField& field,
                                     std::uint32_t& flags) noexcept {
  landmarks.number();
  FactorStatus status = field.factorize(landmarks);
  if (status) return status;
  LandmarkRepair repair(landmarks.positions, landmarks.displacements, landmarks.anchors, &removed_);
  while (!status) {
    removed_.clear();
    const Repaired repaired = repair.drop(status);
    if (repaired == Repaired::kNothing) break;
    flags |= repaired == Repaired::kMerged ? kStepMerged : kStepDropped;
    for (const std::size_t i : removed_) landmarks.remove(i);
    landmarks.number();
    status = field.factorize(landmarks);
  }
  return status;
}

// A displacement u takes the forces K⁻¹ u at once, of which r has relaxed: needles and body feel K⁻¹ u − r. So
// u = d − C (K⁻¹ u − r), that is, (K + C) K⁻¹ u = d + C r; and the bounds, which hold for what is felt, are moved by r.
void ContactSolve::add_relaxed(LandmarkSet& landmarks) noexcept {
  relaxed_.assign(landmarks.positions.size(), Vec3::Zero());
  for (std::size_t i = 0; i < owned_.size(); ++i) relaxed_[landmarks.anchors + i] = -owned_[i]->relaxed_n;
  yielded_.assign(landmarks.positions.size(), Vec3::Zero());
  landmarks.compliance.subtract(relaxed_, yielded_);
  for (Vec3& r : relaxed_) r = -r;
  for (std::size_t i = 0; i < landmarks.owners.size(); ++i)
    landmarks.displacements[landmarks.anchors + i] += yielded_[landmarks.anchors + i];
}

void ContactSolve::find_slips(std::span<NeedleContact> needles, ProbeContact* probe, LandmarkSet& landmarks,
                              TissueField& field, std::uint32_t& flags) noexcept {
  const std::size_t first = landmarks.anchors, count = landmarks.owners.size();
  owned_.clear();
  axes_.clear();
  for (const LandmarkSet::Owner owner : landmarks.owners) {
    const bool is_probe = owner.needle == needles.size();
    owned_.push_back(&(is_probe ? probe->landmarks() : needles[owner.needle].landmarks())[owner.index]);
    axes_.push_back(owned_.back()->axis);
  }
  const auto landmark = [&](std::size_t i) -> NeedleLandmark& { return *owned_[i]; };
  const auto m = static_cast<Eigen::Index>(count);
  auto H = stiffness_.topLeftCorner(m, m);
  field.axial_stiffness(first, axes_, H);
  for (auto* v : {&slip_.stuck, &slip_.low, &slip_.high, &slip_.slips, &slip_.axial}) v->resize(count);
  reactions_.resize(landmarks.positions.size());
  add_relaxed(landmarks);

  for (bool again = true; again;) {
    field.solve(landmarks.displacements, reactions_);
    for (std::size_t i = 0; i < count; ++i) {
      slip_.stuck[i] = axes_[i].dot(reactions_[first + i]);
      const double relaxed = axes_[i].dot(relaxed_[first + i]);
      slip_.low[i] = landmark(i).low_n + relaxed;
      slip_.high[i] = landmark(i).high_n + relaxed;
    }
    const ReactionSolver::Result result =
        solver_.solve(H, slip_.stuck, slip_.low, slip_.high, slip_.slips, slip_.axial);
    if (!result.converged) flags |= kStepSlipUnsettled;
    for (std::size_t i = 0; i < count; ++i) landmark(i).slip_mm = slip_.slips[i];
    again = false;
    for (NeedleContact& needle : needles) again |= needle.reaches_uncut_tissue();
    for (std::size_t i = 0; i < count; ++i)
      landmarks.displacements[first + i] =
          landmark(i).if_stuck - (again ? 0 : slip_.slips[i]) * axes_[i] + yielded_[first + i];
  }
  field.solve(landmarks.displacements, reactions_);
  for (std::size_t i = 0; i < reactions_.size(); ++i) reactions_[i] -= relaxed_[i];
  body_motion_ = landmarks.compliance.body_motion(reactions_);
  for (std::size_t i = 0; i < count; ++i) {
    landmark(i).reaction_n = reactions_[first + i];
    landmark(i).body_mm = landmarks.compliance.moved_with_body(first + i, body_motion_).dot(axes_[i]);
  }
}

// The forces that move each needle's landmarks together by 1 mm of the hand while all others are held. Along a needle
// all its landmarks have its axis, or its course's there, and H knows it; but for those that it pushes from the side.
void ContactSolve::find_stiffnesses(std::span<const NeedleContact> needles, const ProbeContact* probe,
                                    const LandmarkSet& landmarks, TissueField& field) noexcept {
  along_.assign(needles.size() + 1, 0);
  across_.assign(needles.size() + 1, 0);
  if (landmarks.owners.empty()) return;
  groups_.of.assign(landmarks.positions.size(), TissueField::kNoGroup);
  groups_.motions.assign(landmarks.positions.size(), Vec3::Zero());
  groups_.instruments.clear();
  groups_.directions.clear();
  const std::size_t count = landmarks.owners.size();
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t of = landmarks.owners[i].needle;
    auto known = std::ranges::find(groups_.instruments, of);
    const auto group = static_cast<std::uint32_t>(known - groups_.instruments.begin());
    groups_.of[landmarks.anchors + i] = group;
    const bool is_new = known == groups_.instruments.end();
    if (is_new) {
      groups_.instruments.push_back(of);
      groups_.directions.push_back(of == needles.size() ? probe->direction()
                                                        : needles[of].lateral_direction());
    }
    const double share = of == needles.size() ? 1 : needles[of].share_of_hand(*owned_[i]);
    groups_.motions[landmarks.anchors + i] = share * groups_.directions[group];
  }
  groups_.stiffnesses.resize(groups_.directions.size());
  field.rigid_stiffness(groups_.of, groups_.motions, groups_.stiffnesses);
  for (std::size_t g = 0; g < groups_.instruments.size(); ++g)
    (groups_.instruments[g] == needles.size() ? along_ : across_)[groups_.instruments[g]] =
        groups_.stiffnesses[g];
  const auto is_along = [&](std::size_t i) {
    return needles[landmarks.owners[i].needle].is_along(*owned_[i]);
  };
  for (std::size_t j = 0; j < count; ++j)
    for (std::size_t i = 0; i < count; ++i)
      if (landmarks.owners[i].needle == landmarks.owners[j].needle &&
          landmarks.owners[i].needle < needles.size() && is_along(i) && is_along(j))
        along_[landmarks.owners[i].needle] +=
            stiffness_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
}

}  // namespace brachy
