#include "core/simulation/instruments.h"

#include <algorithm>

namespace brachy {
namespace {

NeedlePose pose_of(std::size_t n, std::span<const NeedlePose> poses) {
  return n < poses.size() ? poses[n] : NeedlePose{};
}

}  // namespace

Instruments::Instruments(const SimulationModel& model, bool knows_forces)
    : period_s_(model.settings.period_s),
      length_mm_(model.settings.needle.length_mm),
      noise_(model.settings.noise, model.settings.needle.count) {
  const SimulationSettings& settings = model.settings;
  for (std::size_t n = 0; n < settings.needle.count; ++n) {
    const bool has_course = n < settings.courses.size();
    needles_.emplace_back(model.surface, model.needle_tissues, settings.needle, settings.contact,
                          model.guide_z_mm(), has_course ? settings.courses[n] : std::vector<Vec3>());
    bone_stops_.emplace_back(model.organs, settings.contact.bone_n_per_mm, settings.needle.length_mm,
                             settings.contact.max_jump_mm);
  }
  const std::size_t locking = std::min<std::size_t>(settings.needle.count, settings.needle.locking_count);
  for (NeedleContact& needle : std::span(needles_).last(locking)) needle.lock();
  if (!knows_forces)
    for (NeedleContact& needle : needles_) needle.press_as_one_point();
  if (settings.probe.on) probe_.emplace(model.surface.mesh(), settings.probe, settings.contact);
  states_.resize(needles_.size() + (probe_ ? 1 : 0));
  pose_histories_.resize(states_.size());
}

std::uint32_t Instruments::begin(std::uint64_t tick, std::span<const NeedlePose> poses,
                                 const DisplacementField& last_field, const BodyFrame& frame) noexcept {
  std::uint32_t flags = 0;
  const double t_s = static_cast<double>(tick) * period_s_;
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const NeedlePose pose = pose_of(i, poses);
    take_pose(i, pose, tick);
    if (i == needles_.size()) {
      begin_probe(pose, last_field, frame);
      if (pose.present) flags |= probe_->flags();
    } else {
      begin_needle(i, pose, t_s, last_field, frame);
      if (pose.present) flags |= needles_[i].flags();
    }
  }
  return flags;
}

void Instruments::hold(std::uint64_t tick, std::span<const NeedlePose> poses) noexcept {
  for (std::size_t i = 0; i < states_.size(); ++i) {
    const NeedlePose pose = pose_of(i, poses);
    if (!pose.present || !states_[i].present) states_[i].X_WN = pose.X_WN;
    take_pose(i, pose, tick);
    if (!pose.present) skip(i);
  }
}

// What is known of an instrument's pose before contact is asked.
void Instruments::take_pose(std::size_t instrument, const NeedlePose& pose, std::uint64_t tick) noexcept {
  states_[instrument].present = pose.present;
  states_[instrument].input = pose;
  if (pose.present)
    pose_histories_[instrument][tick % NeedleStates::kPoseHistory] = {tick, pose.X_WN, pose.button};
}

void Instruments::skip(std::size_t instrument) noexcept {
  if (instrument == needles_.size()) return probe_->skip();
  needles_[instrument].skip();
  bone_stops_[instrument].skip();
}

void Instruments::begin_needle(std::size_t n, const NeedlePose& pose, double t_s,
                               const DisplacementField& last_field, const BodyFrame& frame) noexcept {
  NeedleState& state = states_[n];
  state.X_WN = pose.X_WN;
  if (!pose.present) return skip(n);
  if (noise_.is_on()) state.X_WN = noise_.held(n, pose.X_WN, t_s, period_s_, is_in_tissue(n));
  const Vec3 bend = state.shape.is_bent ? state.shape.tip_deflection : Vec3(Vec3::Zero());
  state.X_WN = bone_stops_[n].hold(state.X_WN, bend);
  needles_[n].begin(state.X_WN, &last_field, frame);
}

void Instruments::begin_probe(const NeedlePose& pose, const DisplacementField& last_field,
                              const BodyFrame& frame) noexcept {
  states_.back().X_WN = pose.X_WN;
  pose.present ? probe_->begin(pose.X_WN, last_field, frame) : probe_->skip();
}

std::uint32_t Instruments::find_shapes() noexcept {
  std::uint32_t flags = 0;
  for (std::size_t n = 0; n < needles_.size(); ++n) {
    const NeedleContact& needle = needles_[n];
    NeedleShape& shape = states_[n].shape;
    if (states_[n].present && needle.course()) {
      lay_along(n, *needle.course());
      continue;
    }
    const NeedleBend* bend = states_[n].present ? needle.bend() : nullptr;
    shape.is_bent = bend != nullptr;
    if (!bend) continue;
    flags |= needle.flags();
    const Vec3& hand_tip = states_[n].X_WN.p;
    const Beam& beam = bend->beam();
    for (std::size_t k = 0; k < NeedleShape::kPoints; ++k) {
      const double s = beam.length_mm * static_cast<double>(k) / (NeedleShape::kPoints - 1);
      shape.points[k] =
          hand_tip + needle.direction_in_world((s - beam.length_mm) * beam.axis + bend->deflection(s));
    }
    shape.tip_axis = needle.direction_in_world(beam.axis + bend->tip_slope()).normalized();
    shape.tip_deflection = needle.direction_in_world(bend->tip_deflection());
  }
  return flags;
}

void Instruments::lay_along(std::size_t n, const FollowedCourse& course) noexcept {
  const NeedleContact& needle = needles_[n];
  NeedleShape& shape = states_[n].shape;
  const Vec3 tip = course.point(0);
  for (std::size_t k = 0; k < NeedleShape::kPoints; ++k) {
    const double behind = length_mm_ * (1 - static_cast<double>(k) / (NeedleShape::kPoints - 1));
    shape.points[k] = states_[n].X_WN.p + needle.direction_in_world(course.point(behind) - tip);
  }
  shape.is_bent = true;
  shape.tip_axis = states_[n].X_WN.R.col(2);
  shape.tip_deflection.setZero();
}

void Instruments::write(std::uint64_t since, std::uint64_t tick, NeedleStates& told) noexcept {
  for (std::size_t n = 0; n < needles_.size(); ++n) tell_needle(n);
  if (probe_) tell_probe();
  told.states = states_;
  constexpr std::uint64_t kHistory = NeedleStates::kPoseHistory;
  const std::uint64_t oldest_lacking = std::max(since + 1, tick < kHistory ? 1 : tick - kHistory + 1);
  for (std::size_t i = 0; i < states_.size(); ++i)
    for (std::uint64_t t = oldest_lacking; t <= tick; ++t)
      told.pose_histories[i][t % kHistory] = pose_histories_[i][t % kHistory];
}

void Instruments::tell_needle(std::size_t n) noexcept {
  const NeedleContact& needle = needles_[n];
  NeedleState& state = states_[n];
  state.contact = needle.state();
  state.insertion_depth_mm = needle.insertion_depth();
  state.tip_depth_mm = needle.tip_depth();
  state.landmark_count = static_cast<std::uint32_t>(needle.landmarks().size());
  state.puncture_count = needle.puncture_count();
  state.forces = needle.forces();
  state.local_model = needle.local_model();
  if (bone_stops_[n].is_stopped()) bone_stops_[n].add_to(state.forces, state.local_model);
}

void Instruments::tell_probe() noexcept {
  NeedleState& state = states_.back();
  state.contact = probe_->state();
  state.insertion_depth_mm = state.tip_depth_mm = probe_->indentation_mm();
  state.landmark_count = static_cast<std::uint32_t>(probe_->landmarks().size());
  state.forces = probe_->forces();
  state.local_model = probe_->local_model();
}

std::uint64_t Instruments::punctures() const noexcept {
  std::uint64_t count = 0;
  for (const NeedleContact& needle : needles_) count += needle.puncture_count();
  return count;
}

bool Instruments::is_in_tissue(std::size_t needle) const noexcept {
  const ContactState contact = needles_[needle].state();
  return contact == ContactState::kInserted || contact == ContactState::kThrough;
}

void Instruments::resume_from(const Instruments& other) noexcept {
  pose_histories_ = other.pose_histories_;
  for (std::size_t i = 0; i < states_.size(); ++i) states_[i].drops = other.states_[i].drops;
}

}  // namespace brachy
