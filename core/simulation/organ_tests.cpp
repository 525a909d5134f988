#include "core/simulation/organ_tests.h"

#include <array>

namespace brachy {

OrganTests::OrganTests(const SimulationModel& model) : model_(model) {
  for (std::size_t n = 0; n < model.settings.needle.count; ++n) tests_.emplace_back(model.organs);
  states_.resize(tests_.size() * model.organs.size());
}

void OrganTests::update(std::uint64_t tick, const Instruments& instruments, const BodyFrame& frame) noexcept {
  const std::size_t count = model_.organs.size();
  if (count == 0) return;
  for (std::size_t n = 0; n < tests_.size(); ++n) {
    const std::span states = std::span(states_).subspan(n * count, count);
    const NeedleState& state = instruments.states()[n];
    if (!state.present) {
      tests_[n].update(tick, model_.settings.period_s, nullptr, states);
      continue;
    }
    const NeedleContact& needle = instruments.needles()[n];
    const Vec3 axis = state.X_WN.R.col(2), tip = state.X_WN.p;
    const std::array<Vec3, 2> straight = {tip - model_.settings.needle.length_mm * axis, tip};
    NeedleCourse course{.points = straight, .axis = axis, .is_stopped = instruments.is_stopped_by_bone(n)};
    if (state.shape.is_bent) course.points = state.shape.points;
    if (instruments.is_in_tissue(n)) {
      course.path = &needle.path();
      course.tip_s = needle.tip_arc_mm();
      course.is_through = needle.state() == ContactState::kThrough;
      course.entry = frame.to_world(needle.path().at(0));
      course.exit = frame.to_world(needle.path().at(needle.path().length()));
    } else if (needle.is_pressing()) {
      course.pressed_at = needle.contact_point();
      course.entry = frame.to_world(needle.contact_point());
    }
    tests_[n].update(tick, model_.settings.period_s, &course, states);
  }
}

}  // namespace brachy
