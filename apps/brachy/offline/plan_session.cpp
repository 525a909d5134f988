#include "apps/brachy/offline/plan_session.h"

namespace brachy {
namespace {

constexpr double kOutsideMm = 5;  // from the template's plane
constexpr double kRestS = 0.5;    // before the button is pressed
constexpr double kHoldS = 0.1;    // before it is drawn back: the press is seen where it was made
constexpr double kReleaseS = 0.1;

/// A device's motion, keyframe by keyframe.
class ScriptedDevice {
 public:
  explicit ScriptedDevice(const Vec3& tip) { samples_.push_back({0, {Mat3::Identity(), tip}, false}); }

  void go_to(const Vec3& tip, double speed_mm_s) {
    const double way = (tip - samples_.back().X_WN.p).norm();
    add(way / speed_mm_s, tip, samples_.back().button);
  }
  void wait(double s) { add(s, samples_.back().X_WN.p, samples_.back().button); }
  /// The button from now on, as the newest sample says it.
  void set_button(bool held) { samples_.back().button = held; }
  Trajectory trajectory() && { return Trajectory(std::move(samples_)); }

 private:
  void add(double after_s, const Vec3& tip, bool button) {
    if (after_s <= kSameTime) return;
    samples_.push_back({samples_.back().t_s + after_s, {Mat3::Identity(), tip}, button});
  }
  std::vector<TrajectorySample> samples_;
};

}  // namespace

Trajectory session_of(const Plan& plan, const TemplateGrid& grid, const SessionSpeeds& speeds) {
  const auto start = [&](std::size_t n) -> Vec3 {
    return *grid.position(plan.needles[n].hole) - kOutsideMm * Vec3::UnitZ();
  };
  ScriptedDevice device(start(0));
  for (std::size_t n = 0; n < plan.needles.size(); ++n) {
    const Vec3 tip = plan.planned_tip(grid, n);
    const double train = plan.needles[n].train_length_mm();
    device.go_to(start(n), speeds.speed_mm_s);
    device.go_to(tip, speeds.speed_mm_s);
    device.wait(kRestS);
    device.set_button(true);
    device.wait(kHoldS);
    device.go_to(tip - train * Vec3::UnitZ(), speeds.drop_speed_mm_s);
    device.go_to(start(n), speeds.speed_mm_s);
    device.set_button(false);
    device.wait(kReleaseS);
  }
  return std::move(device).trajectory();
}

}  // namespace brachy
