#include "haptics/simulated/simulated_loop.h"

#include <algorithm>
#include <cmath>

namespace brachy {

namespace {

std::int64_t to_ns(double seconds) {
  return std::llround(1e9 * seconds);
}

}  // namespace

SimulatedLoop::SimulatedLoop(const LoopSettings& settings, LoopSimulation simulation,
                             const RigidTransform& start)
    : settings_(settings),
      simulation_(std::move(simulation)),
      period_ns_(to_ns(1 / settings.device.rate_hz)),
      tick_period_ns_(to_ns(1 / settings.simulation_hz)),
      wire_period_ns_(to_ns(1 / settings.wire_hz)),
      poses_(to_ns(settings.delay_s), settings.drop_share, settings.seed),
      models_(settings.local_model ? to_ns(settings.delay_s) : 0),
      forces_(to_ns(settings.delay_s)),
      device_(settings.device, start.p),
      R_WN_(start.R),
      local_(settings.limits),
      received_(settings.limits.max_force_n) {}

Vec3 SimulatedLoop::step(const RigidTransform& hand) {
  serve_until(now_ns_);
  const Vec3 tip = device_.measured_tip();
  Vec3 force_n = force_now(tip);
  poses_.push({.X_WN = {R_WN_, tip}, .sequence = ++sequence_, .stamp_ns = now_ns_, .present = true}, now_ns_);
  device_.advance(force_n, hand.p);
  R_WN_ = hand.R;
  now_ns_ += period_ns_;
  return force_n;
}

Vec3 SimulatedLoop::force_now(const Vec3& tip) {
  if (settings_.local_model) {
    if (const auto m = models_.newest(now_ns_)) local_.take(m->model, m->pose_stamp_ns, now_ns_);
    return local_.evaluate(tip, now_ns_).force_n;
  }
  if (const auto f = forces_.newest(now_ns_)) {
    if (f->pose_stamp_ns >= 0) longest_delay_ns_ = std::max(longest_delay_ns_, now_ns_ - f->pose_stamp_ns);
    received_.take(f->force_n, 0, false, now_ns_);
  }
  return received_.evaluate(now_ns_);
}

// The server's ticks and evaluations before `now_ns`, in order of time; at the same instant the tick first.
void SimulatedLoop::serve_until(std::int64_t now_ns) {
  for (;;) {
    const bool ticks = settings_.local_model || next_tick_ns_ <= next_evaluation_ns_;
    const std::int64_t at_ns = ticks ? next_tick_ns_ : next_evaluation_ns_;
    if (at_ns >= now_ns || 1e-9 * static_cast<double>(at_ns) >= settings_.server_ends_s) return;
    if (ticks) {
      tick(at_ns);
      next_tick_ns_ += tick_period_ns_;
    } else {
      evaluate(at_ns);
      next_evaluation_ns_ += wire_period_ns_;
    }
  }
}

void SimulatedLoop::receive_pose(std::int64_t at_ns) {
  const auto pose = poses_.newest(at_ns);
  if (!pose) return;
  pose_ = *pose;
  pose_.received_ns = at_ns;
}

void SimulatedLoop::tick(std::int64_t at_ns) {
  receive_pose(at_ns);
  const LocalContactModel model = simulation_(pose_);
  if (pose_.present) models_.push({model, pose_.stamp_ns}, at_ns);
}

void SimulatedLoop::evaluate(std::int64_t at_ns) {
  receive_pose(at_ns);
  if (const auto m = models_.newest(at_ns)) local_.take(m->model, m->pose_stamp_ns, at_ns);
  if (!pose_.present) return;
  forces_.push({local_.evaluate(pose_.X_WN.p, pose_.stamp_ns, at_ns).force_n, pose_.stamp_ns}, at_ns);
}

}  // namespace brachy
