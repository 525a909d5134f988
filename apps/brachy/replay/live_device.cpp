#include "apps/brachy/replay/live_device.h"

#include <cmath>

namespace brachy {

LiveDevice::LiveDevice(const SimulatedDeviceOptions& options, Hand hand, std::int64_t start_ns)
    : settings_(loop_settings(options)),
      hand_(std::move(hand)),
      start_ns_(start_ns),
      next_ns_(start_ns),
      device_(settings_.device, hand_(0).p),
      local_(settings_.limits),
      received_(settings_.limits.max_force_n),
      poses_(std::llround(1e9 * settings_.delay_s), settings_.drop_share, settings_.seed),
      models_(std::llround(1e9 * settings_.delay_s)),
      forces_(std::llround(1e9 * settings_.delay_s)),
      report_(hand_report(options)) {}

std::optional<LiveDevice::Pose> LiveDevice::advance(std::int64_t now_ns) {
  while (next_ns_ <= now_ns) {
    cycle(next_ns_);
    next_ns_ = start_ns_ + std::llround(1e9 * static_cast<double>(++cycles_) / settings_.device.rate_hz);
  }
  return poses_.newest(now_ns);
}

void LiveDevice::cycle(std::int64_t at_ns) {
  const double period_s = 1 / settings_.device.rate_hz, t_s = static_cast<double>(cycles_) * period_s;
  const Vec3 tip = device_.measured_tip();
  const Vec3 force_n = force_now(tip, at_ns);
  poses_.push({{hand_(t_s).R, tip}, at_ns}, at_ns);
  report_.add(t_s, period_s, force_n, device_.tip() - device_.hand());
  device_.advance(force_n, hand_(t_s + period_s).p);
}

Vec3 LiveDevice::force_now(const Vec3& tip, std::int64_t at_ns) {
  if (settings_.local_model) {
    if (const auto m = models_.newest(at_ns)) local_.take(m->model, m->pose_stamp_ns, at_ns);
    return local_.evaluate(tip, at_ns).force_n;
  }
  if (const auto f = forces_.newest(at_ns))
    received_.take(f->forces.force_n, f->valid_ms, (f->flags & net::kForceLatched) != 0, at_ns);
  return received_.evaluate(at_ns);
}

}  // namespace brachy
