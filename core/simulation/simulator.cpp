#include "core/simulation/simulator.h"

#include <algorithm>
#include <utility>

#include "core/simulation/make_guarded_field.h"

namespace brachy {
namespace {

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

}  // namespace

Simulator::Simulator(std::shared_ptr<const SimulationModel> model)
    : model_(std::move(model)),
      field_(make_guarded_field(*model_)),
      instruments_(*model_, field_->plain_field().knows_forces()),
      landmarks_(*model_, field_->plain_field().gives_way()),
      contact_solve_(model_->max_landmarks(), model_->settings.period_s),
      body_(model_->body_at_rest),
      mesh_(model_->tissue),
      seeds_(*model_),
      organs_(*model_) {}

void Simulator::resume_from(const Simulator& other) noexcept {
  tick_ = other.tick_;
  body_.resume_from(other.body_);
  seeds_.resume_from(other.seeds_, tick_, *field_, body_.frame());
  instruments_.resume_from(other.instruments_);
}

MeshState Simulator::initial_state() const {
  MeshState state;
  state.mesh.deformed_vertices = mesh_.rest();
  state.mesh.block_ticks.assign(tissue().blocks.size(), 0);
  state.needles.states.assign(instruments_.states().begin(), instruments_.states().end());
  state.needles.pose_histories = instruments_.pose_histories();
  state.needles.organ_contacts = organs_.contacts();
  state.seeds.slots.resize(seeds_.max_count());
  state.seeds.ticks.resize(seeds_.max_count());
  state.seeds.count = static_cast<std::uint32_t>(seeds_.in_tissue().size());
  std::ranges::copy(seeds_.in_tissue(), state.seeds.slots.begin());
  return state;
}

void Simulator::step(std::span<const NeedlePose> poses, MeshState& state) noexcept {
  ++tick_;
  mesh_.begin(tick_);
  body_.swell(instruments_.punctures(), period_s());
  if (std::exchange(is_field_due_, false)) {
    flags_ = kStepLate;
    instruments_.hold(tick_, poses);
    deform();
  } else {
    flags_ = instruments_.begin(tick_, poses, *field_, body_.frame());
    landmarks_.gather(instruments_, body_);
    if (solve_contacts()) deform();
  }
  flags_ |= instruments_.find_shapes();
  organs_.update(tick_, instruments_, body_.frame());
  seeds_.drop(tick_, instruments_, {*field_, body_.frame(), mesh_});
  write(state);
}

// False where the tissue stays where it is: the system has no solution, or the tick no time for more.
bool Simulator::solve_contacts() noexcept {
  if (!contact_solve_.solve(tick_, instruments_.needles(), instruments_.probe(), landmarks_.set(),
                            field_->plain_field(), flags_)) {
    flags_ |= kStepSolveFailed;  // the last field is kept
    return false;
  }
  is_field_due_ = is_over_budget();
  if (is_field_due_) flags_ |= kStepLate | field_->flags();
  return !is_field_due_;
}

// Sub-steps are as many as the last field had. Counted, not timed: the same poses give the same bits.
bool Simulator::is_over_budget() const noexcept {
  const LandmarkSet& set = landmarks_.set();
  const Allowance may = model_->work_budget().allowance(
      {.landmarks = set.positions.size(), .steps = field_->certificate().substeps});
  return field_->always_composes() && !may.may_find_field && !field_->shows(set);
}

// Where the whole field is due it lags as far as its landmarks have gone since.
double Simulator::lag_mm() const noexcept {
  double lag = field_->lag_mm();
  if (!is_field_due_) return lag;
  const std::span<const Vec3> now = landmarks().displacements,
                              shown = field_->plain_field().landmark_displacements();
  for (std::size_t i = 0; i < now.size(); ++i)
    lag = std::max(lag, (now[i] - (i < shown.size() ? shown[i] : Vec3(Vec3::Zero()))).norm());
  return lag;
}

void Simulator::deform() noexcept {
  if (!field_->update(landmarks_.set())) {
    flags_ |= kStepSolveFailed;  // the last field is kept
    return;
  }
  flags_ |= field_->flags();
  ++evaluation_counts_[static_cast<std::size_t>(field_->evaluation())];
  if (body_.compliance()) body_.set_motion(contact_solve_.body_motion());
  if (field_->evaluation() == Evaluation::kIdle && mesh_.is_in(body_.frame())) return;
  mesh_.show(*field_, body_.frame());
  seeds_.move(tick_, *field_, body_.frame());
}

void Simulator::write(MeshState& state) noexcept {
  TickSummary& summary = state.summary;
  mesh_.write(summary.tick, state.mesh);
  instruments_.write(summary.tick, tick_, state.needles);
  state.needles.organ_contacts = organs_.contacts();
  seeds_.write(summary.tick, state.seeds, state.failed_drops);

  summary.tick = tick_;
  summary.sim_time_s = static_cast<double>(tick_) * period_s();
  summary.landmark_count = static_cast<std::uint32_t>(landmarks().positions.size());
  summary.certificate = field_->certificate();
  summary.step_flags = flags_ | flag_of(summary.certificate.verdict);
  summary.certificate.condition = field_->plain_field().condition();
  summary.lag_mm = lag_mm();
  summary.max_displacement_mm = mesh_.max_displacement_mm();
  summary.moved_vertices = mesh_.moved_vertices();
}

}  // namespace brachy
