#include "core/simulation/simulator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/simulation/make_guarded_field.h"

namespace brachy {
namespace {

NeedlePose pose_of(std::size_t n, std::span<const NeedlePose> poses) {
  return n < poses.size() ? poses[n] : NeedlePose{};
}

// The verdict of the field that stands is told in every tick, also where that field is an earlier tick's.
std::uint32_t flag_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kFolded:
      return kStepFolded;
    case Verdict::kUnknown:
      return kStepUncertified;
    case Verdict::kInjective:
      break;
  }
  return 0;
}

// What is known of an instrument's pose in a tick before contact is asked.
void take_pose(const NeedlePose& pose, std::uint64_t tick, NeedleState& state,
               NeedleStates::PoseHistory& history) {
  state.present = pose.present;
  state.input = pose;
  if (pose.present) history[tick % NeedleStates::kPoseHistory] = {tick, pose.X_WN, pose.button};
}

}  // namespace

Simulator::Simulator(std::shared_ptr<const SimulationModel> model)
    : model_(std::move(model)),
      tissue_(model_->tissue),
      period_s_(model_->settings.period_s),
      contact_solve_(model_->max_landmarks(), model_->settings.period_s),
      noise_(model_->settings.noise, model_->settings.needle.count),
      body_(model_->body_at_rest),
      anchors_(model_->anchors),
      anchor_clearance_(model_->settings.anchors.clearance_mm),
      field_(make_guarded_field(*model_)),
      seed_loading_(model_->settings.seeds, model_->settings.template_grid, model_->plan,
                    model_->settings.needle.count),
      implant_(static_cast<std::size_t>(model_->settings.seeds.max_count)),
      block_ticks_(tissue_.blocks.size()),
      block_evaluated_(tissue_.blocks.size()) {
  const std::size_t needle_count = model_->settings.needle.count;
  for (std::size_t n = 0; n < needle_count; ++n)
    contacts_.emplace_back(model_->surface, model_->needle_tissues, model_->settings.needle,
                           model_->settings.contact, model_->guide_z_mm());
  for (std::size_t n = 0; n < needle_count; ++n) {
    bone_stops_.emplace_back(model_->organs, model_->settings.contact.bone_n_per_mm,
                             model_->settings.needle.length_mm, model_->settings.contact.max_jump_mm);
    organ_contacts_.emplace_back(model_->organs);
  }
  organ_states_.resize(needle_count * model_->organs.size());
  const std::size_t locking = std::min(needle_count, model_->settings.needle.locking_count);
  for (std::size_t n = needle_count - locking; n < needle_count; ++n) contacts_[n].lock();
  if (!field_->plain_field().knows_forces())
    for (NeedleContact& contact : contacts_) contact.press_as_one_point();
  if (model_->settings.probe.on)
    probe_.emplace(model_->surface.mesh(), model_->settings.probe, model_->settings.contact);
  landmarks_.reserve(model_->max_landmarks());
  const std::size_t instrument_count = needle_count + (probe_ ? 1 : 0);
  needles_.resize(instrument_count);
  last_on_shaft_.resize(needle_count);
  needle_order_.reserve(needle_count, static_cast<std::size_t>(model_->settings.contact.max_landmarks));
  beams_.resize(needle_count, -1);
  pose_histories_.resize(instrument_count);
  displaced_.reserve(tissue_.blocks.size());
  was_displaced_.reserve(tissue_.blocks.size());
  for (auto& blocks : changed_) blocks.reserve(tissue_.blocks.size());
  rest_.reserve(3 * tissue_.size());
  for (const Vec3& X : tissue_.rest_vertices)
    for (int k = 0; k < 3; ++k) rest_.push_back(static_cast<float>(X[k]));
  deformed_ = rest_;
}

void Simulator::restore_seeds(std::span<const Seed> seeds) {
  implant_.restore(seeds);
  for (const Seed& seed : seeds) seed_loading_.mark_dropped(seed.planned);
}

void Simulator::restore_lost(std::span<const std::int32_t> planned) {
  for (const std::int32_t seed : planned) seed_loading_.mark_dropped(seed);
}

void Simulator::resume_from(const Simulator& other) noexcept {
  tick_ = other.tick_;
  implant_ = other.implant_;
  body_.resume_from(other.body_);
  MovedField moved(*field_, body_.frame());
  implant_.move(tick_, moved);
  seed_loading_ = other.seed_loading_;
  pose_histories_ = other.pose_histories_;
  failed_drops_ = other.failed_drops_;
  for (std::size_t n = 0; n < needles_.size(); ++n) needles_[n].drops = other.needles_[n].drops;
}

MeshState Simulator::initial_state() const {
  MeshState state;
  state.mesh.deformed_vertices = rest_;
  state.mesh.block_ticks.assign(tissue_.blocks.size(), 0);
  state.needles.states = needles_;
  state.needles.pose_histories = pose_histories_;
  state.needles.organ_contacts = organ_states_;
  state.seeds.slots.resize(implant_.max_count());
  state.seeds.ticks.resize(implant_.max_count());
  state.seeds.count = static_cast<std::uint32_t>(implant_.seeds().size());
  std::ranges::copy(implant_.seeds(), state.seeds.slots.begin());
  return state;
}

void Simulator::step(std::span<const NeedlePose> poses, MeshState& state) noexcept {
  ++tick_;
  changed_[tick_ % kChangeHistory].clear();
  std::uint64_t punctures = 0;
  for (const NeedleContact& contact : contacts_) punctures += contact.puncture_count();
  body_.swell(punctures, period_s_);
  if (is_field_due_) {
    hold_contacts(poses);
    is_field_due_ = false;
    deform();
  } else {
    begin_contacts(poses);
    gather_landmarks();
    if (solve_contacts()) deform();
  }
  find_shapes();
  test_organs();
  drop_seeds();
  write_state(state);
}

void Simulator::begin_contacts(std::span<const NeedlePose> poses) noexcept {
  flags_ = 0;
  for (std::size_t n = 0; n < contacts_.size(); ++n) {
    const NeedlePose pose = pose_of(n, poses);
    take_pose(pose, tick_, needles_[n], pose_histories_[n]);
    const ContactState last = contacts_[n].state();
    const bool is_in = last == ContactState::kInserted || last == ContactState::kThrough;
    if (pose.present && noise_.is_on())
      needles_[n].X_WN = noise_.held(n, pose.X_WN, static_cast<double>(tick_) * period_s_, period_s_, is_in);
    else
      needles_[n].X_WN = pose.X_WN;
    if (!pose.present) {
      contacts_[n].skip();
      bone_stops_[n].skip();
      continue;
    }
    const Vec3 bend = needles_[n].shape.is_bent ? needles_[n].shape.tip_deflection : Vec3(Vec3::Zero());
    needles_[n].X_WN = bone_stops_[n].hold(needles_[n].X_WN, bend);
    contacts_[n].begin(needles_[n].X_WN, field_.get(), body_.frame());
    flags_ |= contacts_[n].flags();
  }
  if (probe_) begin_probe(pose_of(contacts_.size(), poses));
}

// A tick that has the field of the last one's landmarks to find leaves contacts and forces as they are.
void Simulator::hold_contacts(std::span<const NeedlePose> poses) noexcept {
  flags_ = kStepLate;
  for (std::size_t n = 0; n < needles_.size(); ++n) {
    NeedleState& state = needles_[n];
    const NeedlePose pose = pose_of(n, poses);
    if (!pose.present || !state.present) state.X_WN = pose.X_WN;
    take_pose(pose, tick_, state, pose_histories_[n]);
    if (pose.present) continue;
    if (n < contacts_.size()) {
      contacts_[n].skip();
      bone_stops_[n].skip();
    } else {
      probe_->skip();
    }
  }
}

void Simulator::begin_probe(const NeedlePose& pose) noexcept {
  NeedleState& state = needles_.back();
  take_pose(pose, tick_, state, pose_histories_.back());
  state.X_WN = pose.X_WN;
  if (!pose.present) return probe_->skip();
  probe_->begin(pose.X_WN, *field_, body_.frame());
  flags_ |= probe_->flags();
}

// Without needle landmarks there are no landmarks at all: anchors alone displace nothing.
void Simulator::gather_landmarks() noexcept {
  landmarks_.clear();
  double load = 0;
  bool touches = probe_ && !probe_->landmarks().empty();
  for (const NeedleContact& contact : contacts_) {
    touches |= !contact.landmarks().empty();
    load = std::max(load, contact.load());
  }
  anchors_.update(touches ? load : 0, period_s_);
  if (!touches) return;
  for (Vec3 anchor : anchors_.positions())
    if (keep_clear(anchor)) landmarks_.add(anchor, Vec3::Zero(), {});
  landmarks_.anchors = landmarks_.positions.size();
  std::ranges::fill(last_on_shaft_, -1);
  if (body_.compliance()) landmarks_.compliance.set_body(*body_.compliance());
  for (std::size_t n = 0; n < contacts_.size(); ++n) {
    const NeedleBend* bend = contacts_[n].landmarks().empty() ? nullptr : contacts_[n].bend();
    beams_[n] = bend ? landmarks_.compliance.add_beam(bend->beam()) : -1;
  }
  needle_order_.update(contacts_);
  if (needle_order_.is_by_rest()) {
    for (const std::uint32_t n : needle_order_.needles())
      for (const bool tip : {false, true}) add_needle(n, tip);
    add_probe();
    return;
  }
  add_probe();
  for (const bool tips : {false, true})
    for (const std::uint32_t n : needle_order_.needles()) add_needle(n, tips);
}

void Simulator::add_probe() noexcept {
  for (std::size_t i = 0; probe_ && i < probe_->landmarks().size(); ++i) {
    NeedleLandmark& landmark = probe_->landmarks()[i];
    add_landmark(landmark, landmark.spread,
                 {static_cast<std::uint32_t>(contacts_.size()), static_cast<std::uint32_t>(i)}, -1);
  }
}

// The landmark of its tip, or those of its shaft.
void Simulator::add_needle(std::size_t n, bool tip) noexcept {
  const std::span<NeedleLandmark> of_needle = contacts_[n].landmarks();
  for (std::size_t i = 0; i < of_needle.size(); ++i) {
    if ((contacts_[n].has_tip_landmark() && i + 1 == of_needle.size()) != tip) continue;
    LandmarkSpread spread = of_needle[i].spread;
    if (tip)
      spread.behind = last_on_shaft_[n];
    else
      last_on_shaft_[n] = static_cast<std::int32_t>(landmarks_.positions.size());
    add_landmark(of_needle[i], spread, {static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(i)},
                 beams_[n]);
  }
}

void Simulator::add_landmark(NeedleLandmark& landmark, const LandmarkSpread& spread, LandmarkSet::Owner owner,
                             std::int32_t beam) noexcept {
  LandmarkCompliance::Point point{.beam = beam, .arc_mm = landmark.arc_mm};
  if (landmark.slides && field_->plain_field().gives_way()) point.slides_on = landmark.axis;
  if (body_.compliance()) {
    // Where it would go if the tissue were rigid: from where the body is now.
    point.arm = landmark.position + landmark.if_stuck - body_.pivot();
    landmark.body = LandmarkCompliance::moved_by(body_.motion(), point.arm);
    landmark.if_stuck += landmark.body;
  }
  landmarks_.add(landmark.position, landmark.if_stuck, spread, point);
  landmarks_.owners.push_back(owner);
}

// Moves an anchor aside that lies in a needle's path: if it were left out once the tip comes near, displacement and
// force would jump. False where several needles leave no position for it.
bool Simulator::keep_clear(Vec3& anchor) const noexcept {
  for (const NeedleContact& contact : contacts_) {
    if (contact.landmarks().empty()) continue;
    const Vec3 on_line = contact.nearest_on_line(anchor), aside = anchor - on_line;
    const double distance = aside.norm();
    if (distance >= anchor_clearance_) continue;
    const Vec3 direction = distance > 0 ? Vec3(aside / distance) : contact.axis().unitOrthogonal();
    anchor = on_line + anchor_clearance_ * direction;
  }
  return std::ranges::none_of(contacts_, [&](const NeedleContact& contact) {
    return std::ranges::any_of(contact.landmarks(), [&](const NeedleLandmark& landmark) {
      return (landmark.position - anchor).norm() < 0.5 * anchor_clearance_;
    });
  });
}

// False where the tissue stays where it is: the system has no solution, or the tick no time for more.
bool Simulator::solve_contacts() noexcept {
  if (!contact_solve_.solve(tick_, contacts_, probe_ ? &*probe_ : nullptr, landmarks_, field_->plain_field(),
                            flags_)) {
    flags_ |= kStepSolveFailed;  // the last field is kept
    return false;
  }
  if (!is_over_budget()) return true;
  is_field_due_ = true;
  flags_ |= kStepLate | field_->flags();
  return false;
}

// Sub-steps are as many as the last field had. Counted, not timed: the same poses give the same bits.
bool Simulator::is_over_budget() const noexcept {
  const Allowance may =
      model_->work_budget().allowance({.landmarks = landmarks_.positions.size(),
                                       .changed_landmarks = needle_order_.changed_landmarks(),
                                       .steps = field_->certificate().substeps});
  return field_->always_composes() && !may.may_find_field &&
         !field_->shows(landmarks_.positions, landmarks_.displacements, landmarks_.spreads,
                        landmarks_.compliance);
}

void Simulator::deform() noexcept {
  if (!field_->update(landmarks_.positions, landmarks_.displacements, landmarks_.spreads,
                      landmarks_.compliance)) {
    flags_ |= kStepSolveFailed;  // the last field is kept
    return;
  }
  flags_ |= field_->flags();
  ++evaluation_counts_[static_cast<std::size_t>(field_->evaluation())];
  if (body_.compliance()) body_.set_motion(contact_solve_.body_motion());
  const bool is_same_frame = body_.frame() == shown_frame_;
  if (field_->evaluation() == Evaluation::kIdle && is_same_frame) return;
  if (is_same_frame && body_.frame().is_identity())
    apply_field();
  else
    apply_everywhere();
  shown_frame_ = body_.frame();
  MovedField moved(*field_, body_.frame());
  implant_.move(tick_, moved);
}

// The body has moved as a whole, or swollen: so has every point.
void Simulator::apply_everywhere() noexcept {
  max_displacement_ = 0;
  moved_vertices_ = 0;
  displaced_.clear();
  for (const std::uint32_t b : field_->touched()) block_evaluated_[b] = tick_;
  for (std::uint32_t b = 0; b < tissue_.blocks.size(); ++b) {
    const Block& block = tissue_.blocks[b];
    const BlockDisplacement<float>* u = block_evaluated_[b] == tick_ ? &field_->displacement(b) : nullptr;
    bool moves = false;
    for (std::uint32_t i = 0; i < block.count; ++i) {
      const float* rest = &rest_[3 * (block.first + i)];
      float* out = &deformed_[3 * (block.first + i)];
      Eigen::Vector3f x(rest[0], rest[1], rest[2]);
      if (u) x += Eigen::Vector3f(u->ux[i], u->uy[i], u->uz[i]);
      if (!body_.frame().is_identity()) x = body_.frame().to_world(x.cast<double>()).cast<float>();
      const double way = (x - Eigen::Vector3f(rest[0], rest[1], rest[2])).cast<double>().norm();
      max_displacement_ = std::max(max_displacement_, way);
      moved_vertices_ += way > 0;
      moves |= way > 0;
      std::copy_n(x.data(), 3, out);
    }
    if (moves) displaced_.push_back(b);
    changed_[tick_ % kChangeHistory].push_back(b);
    block_ticks_[b] = tick_;
  }
}

// Blocks in reach get their displacement; those that were displaced and are out of reach now return to rest. No
// other block is visited.
void Simulator::apply_field() noexcept {
  max_displacement_ = 0;
  moved_vertices_ = 0;
  std::swap(displaced_, was_displaced_);
  displaced_.clear();
  for (const std::uint32_t b : field_->touched()) {
    block_evaluated_[b] = tick_;
    if (apply_block(b)) changed_[tick_ % kChangeHistory].push_back(b);
  }
  for (const std::uint32_t b : was_displaced_) {
    if (block_evaluated_[b] == tick_) continue;
    const Block& block = tissue_.blocks[b];
    std::copy_n(&rest_[3 * block.first], 3 * block.count, &deformed_[3 * block.first]);
    changed_[tick_ % kChangeHistory].push_back(b);
  }
  for (const std::uint32_t b : changed_[tick_ % kChangeHistory]) block_ticks_[b] = tick_;
}

// True if any coordinate of the block changed.
bool Simulator::apply_block(std::uint32_t b) noexcept {
  const Block& block = tissue_.blocks[b];
  const BlockDisplacement<float>& u = field_->displacement(b);
  float* out = &deformed_[3 * block.first];
  const float* rest = &rest_[3 * block.first];
  bool changed = false;
  std::uint32_t moved = 0;
  float largest_squared = 0;
  for (std::uint32_t i = 0; i < block.count; ++i) {
    const float x[3] = {rest[3 * i] + u.ux[i], rest[3 * i + 1] + u.uy[i], rest[3 * i + 2] + u.uz[i]};
    changed |= x[0] != out[3 * i] || x[1] != out[3 * i + 1] || x[2] != out[3 * i + 2];
    moved += x[0] != rest[3 * i] || x[1] != rest[3 * i + 1] || x[2] != rest[3 * i + 2];
    std::memcpy(out + 3 * i, x, sizeof x);
    largest_squared = std::max(largest_squared, u.ux[i] * u.ux[i] + u.uy[i] * u.uy[i] + u.uz[i] * u.uz[i]);
  }
  max_displacement_ = std::max(max_displacement_, std::sqrt(static_cast<double>(largest_squared)));
  moved_vertices_ += moved;
  if (moved > 0) displaced_.push_back(b);
  return changed;
}

void Simulator::find_shapes() noexcept {
  for (std::size_t n = 0; n < contacts_.size(); ++n) {
    NeedleShape& shape = needles_[n].shape;
    const NeedleBend* bend = needles_[n].present ? contacts_[n].bend() : nullptr;
    shape.is_bent = bend != nullptr;
    if (!bend) continue;
    flags_ |= contacts_[n].flags();  // kStepSteep is known once the forces are
    const RigidTransform& X_WN = needles_[n].X_WN;
    const double length = bend->beam().length_mm;
    for (std::size_t k = 0; k < NeedleShape::kPoints; ++k) {
      const double s = length * static_cast<double>(k) / (NeedleShape::kPoints - 1);
      shape.points[k] =
          X_WN.p + contacts_[n].direction_in_world((s - length) * bend->beam().axis + bend->deflection(s));
    }
    shape.tip_axis = contacts_[n].direction_in_world(bend->beam().axis + bend->tip_slope()).normalized();
    shape.tip_deflection = contacts_[n].direction_in_world(bend->tip_deflection());
  }
}

void Simulator::drop_seeds() noexcept {
  for (std::size_t n = 0; n < contacts_.size(); ++n) {
    const NeedleShape& shape = needles_[n].shape;
    NeedlePose pose = needles_[n].input;
    pose.X_WN = needles_[n].X_WN;
    seed_loading_.update(n, pose, is_in_tissue(n), shape.is_bent ? shape.tip_deflection : Vec3(Vec3::Zero()));
    if (seed_loading_.request_failed(n)) refuse_drop(n, DropRefusal::kNothingLoaded, pose.X_WN.p);
    while (const auto due = seed_loading_.due(n)) drop(n, *due);
  }
}

void Simulator::drop(std::size_t needle, const SeedDrop& due) noexcept {
  // In front of the template: there the needle is in the hand.
  const bool is_lost = due.at.z() < model_->settings.template_grid.origin_mm.z();
  DropRefusal refusal = DropRefusal::kLost;
  if (!is_lost) {
    Seed seed;
    seed.tick = tick_;
    seed.t_s = static_cast<double>(tick_) * period_s_;
    seed.needle = static_cast<std::uint16_t>(needle);
    seed.planned = due.planned;
    seed.source = due.source;
    seed.air_kerma_strength_u = due.air_kerma_strength_u;
    seed.dropped = due.at;
    const NeedleShape& shape = needles_[needle].shape;
    seed.dropped_axis = shape.is_bent ? shape.tip_axis : Vec3(needles_[needle].X_WN.R.col(2));
    const auto id = static_cast<std::uint32_t>(implant_.seeds().size() + 1);
    seed.dropped += noise_.drop_offset(id, seed.dropped_axis);
    seed.gland_motion = mean_displacement();
    const MovedField field(*field_, body_.frame());
    const bool is_in = is_in_tissue(needle);
    refusal = implant_.drop(seed, {model_->surface, field, field_->certificate().verdict,
                                   is_in ? contacts_[needle].material_tip() : seed.dropped, is_in});
  }
  if (is_lost) {
    seed_loading_.dropped(needle);
    refuse_drop(needle, refusal, due.at, due.planned);
  } else if (refusal == DropRefusal::kNone) {
    seed_loading_.dropped(needle);
    ++needles_[needle].drops.dropped;
  } else if (seed_loading_.refused(needle)) {
    refuse_drop(needle, refusal, due.at, due.planned);
  }
}

bool Simulator::is_in_tissue(std::size_t needle) const noexcept {
  const ContactState contact = contacts_[needle].state();
  return contact == ContactState::kInserted || contact == ContactState::kThrough;
}

void Simulator::refuse_drop(std::size_t needle, DropRefusal why, const Vec3& at,
                            std::int32_t planned) noexcept {
  ++needles_[needle].drops.refused;
  needles_[needle].drops.last_refusal = why;
  failed_drops_.slots[failed_drops_.count++ % FailedDrops::kKept] = {
      tick_, static_cast<double>(tick_) * period_s_, static_cast<std::uint16_t>(needle), planned, why, at};
}

void Simulator::test_organs() noexcept {
  const std::size_t count = model_->organs.size();
  for (std::size_t n = 0; n < contacts_.size() && count > 0; ++n) {
    const std::span states = std::span(organ_states_).subspan(n * count, count);
    const NeedleState& needle = needles_[n];
    if (!needle.present) {
      organ_contacts_[n].update(tick_, period_s_, nullptr, states);
      continue;
    }
    const NeedleContact& contact = contacts_[n];
    const Vec3 axis = needle.X_WN.R.col(2), tip = needle.X_WN.p;
    const std::array<Vec3, 2> straight = {tip - model_->settings.needle.length_mm * axis, tip};
    NeedleCourse course{.points = straight, .axis = axis, .is_stopped = bone_stops_[n].is_stopped()};
    if (needle.shape.is_bent) course.points = needle.shape.points;
    if (is_in_tissue(n)) {
      course.path = &contact.path();
      course.tip_s = contact.tip_arc_mm();
      course.is_through = contact.state() == ContactState::kThrough;
      course.entry = body_.frame().to_world(contact.path().at(0));
      course.exit = body_.frame().to_world(contact.path().at(contact.path().length()));
    } else if (contact.is_pressing()) {
      course.pressed_at = contact.contact_point();
      course.entry = body_.frame().to_world(contact.contact_point());
    }
    organ_contacts_[n].update(tick_, period_s_, &course, states);
  }
}

Vec3 Simulator::mean_displacement() const noexcept {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < rest_.size(); ++i) sum[static_cast<int>(i % 3)] += deformed_[i] - rest_[i];
  return sum / static_cast<double>(tissue_.size());
}

void Simulator::write_state(MeshState& state) noexcept {
  TickSummary& summary = state.summary;
  DeformedMesh& mesh = state.mesh;
  const auto update_block = [&](std::size_t b) {
    if (mesh.block_ticks[b] == block_ticks_[b]) return;
    const Block& block = tissue_.blocks[b];
    std::copy_n(&deformed_[3 * block.first], 3 * block.count, &mesh.deformed_vertices[3 * block.first]);
    mesh.block_ticks[b] = block_ticks_[b];
  };
  if (tick_ - summary.tick <= kChangeHistory) {
    for (std::uint64_t t = summary.tick + 1; t <= tick_; ++t)
      for (const std::uint32_t b : changed_[t % kChangeHistory]) update_block(b);
  } else {
    for (std::size_t b = 0; b < tissue_.blocks.size(); ++b) update_block(b);
  }

  constexpr std::uint64_t kHistory = NeedleStates::kPoseHistory;
  const std::uint64_t oldest_lacking =
      std::max(summary.tick + 1, tick_ < kHistory ? 1 : tick_ - kHistory + 1);
  for (std::size_t n = 0; n < needles_.size(); ++n)
    for (std::uint64_t t = oldest_lacking; t <= tick_; ++t)
      state.needles.pose_histories[n][t % kHistory] = pose_histories_[n][t % kHistory];

  const std::span<const Seed> seeds = implant_.seeds();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    if (i < state.seeds.count && implant_.changed_tick(i) <= summary.tick) continue;
    state.seeds.slots[i] = seeds[i];
    state.seeds.ticks[i] = implant_.changed_tick(i);
  }
  state.seeds.count = static_cast<std::uint32_t>(seeds.size());

  summary.tick = tick_;
  summary.sim_time_s = static_cast<double>(tick_) * period_s_;
  for (std::size_t n = 0; n < contacts_.size(); ++n) {
    const NeedleContact& contact = contacts_[n];
    needles_[n].contact = contact.state();
    needles_[n].insertion_depth_mm = contact.insertion_depth();
    needles_[n].tip_depth_mm = contact.tip_depth();
    needles_[n].landmark_count = static_cast<std::uint32_t>(contact.landmarks().size());
    needles_[n].puncture_count = contact.puncture_count();
    needles_[n].forces = contact.forces();
    needles_[n].local_model = contact.local_model();
    if (bone_stops_[n].is_stopped()) bone_stops_[n].add_to(needles_[n].forces, needles_[n].local_model);
  }
  if (probe_) {
    NeedleState& state_of_probe = needles_.back();
    state_of_probe.contact = probe_->state();
    state_of_probe.insertion_depth_mm = state_of_probe.tip_depth_mm = probe_->indentation_mm();
    state_of_probe.landmark_count = static_cast<std::uint32_t>(probe_->landmarks().size());
    state_of_probe.forces = probe_->forces();
    state_of_probe.local_model = probe_->local_model();
  }
  state.needles.states = needles_;
  state.needles.organ_contacts = organ_states_;
  for (std::uint64_t& i = state.failed_drops.count; i < failed_drops_.count; ++i)
    state.failed_drops.slots[i % FailedDrops::kKept] = failed_drops_.slots[i % FailedDrops::kKept];
  summary.landmark_count = static_cast<std::uint32_t>(landmarks_.positions.size());
  summary.certificate = field_->certificate();
  summary.step_flags = flags_ | flag_of(summary.certificate.verdict);
  summary.certificate.condition = field_->plain_field().condition();
  summary.max_displacement_mm = max_displacement_;
  summary.moved_vertices = moved_vertices_;
}

}  // namespace brachy
