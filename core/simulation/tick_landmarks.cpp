#include "core/simulation/tick_landmarks.h"

#include <algorithm>

namespace brachy {

TickLandmarks::TickLandmarks(const SimulationModel& model, bool gives_way)
    : period_s_(model.settings.period_s),
      gives_way_(gives_way),
      anchors_(model.anchors),
      anchor_clearance_(model.settings.anchors.clearance_mm),
      budget_(model.work_budget()),
      last_on_shaft_(model.settings.needle.count),
      beams_(model.settings.needle.count, -1) {
  order_.reserve(model.settings.needle.count, static_cast<std::size_t>(model.settings.contact.max_landmarks));
  set_.reserve(model.max_landmarks());
}

void TickLandmarks::gather(Instruments& instruments, const BodyMotion& body) noexcept {
  set_.clear();
  double load = 0;
  bool touches = instruments.probe() && !instruments.probe()->landmarks().empty();
  for (const NeedleContact& needle : instruments.needles()) {
    touches |= !needle.landmarks().empty();
    load = std::max(load, needle.load());
  }
  anchors_.update(touches ? load : 0, period_s_);
  if (!touches) return;
  add_anchors(instruments);
  std::ranges::fill(last_on_shaft_, -1);
  if (body.compliance()) set_.compliance.set_body(*body.compliance());
  for (std::size_t n = 0; n < instruments.needles().size(); ++n) {
    const NeedleContact& needle = instruments.needles()[n];
    const NeedleBend* bend = needle.landmarks().empty() ? nullptr : needle.bend();
    beams_[n] = bend ? set_.compliance.add_beam(bend->beam()) : -1;
  }
  order_.update(instruments.needles(), budget_);
  if (order_.is_by_rest()) {
    for (const std::uint32_t n : order_.needles())
      for (const bool tip : {false, true}) add_needle(instruments, n, tip, body);
    add_probe(instruments, body);
    return;
  }
  add_probe(instruments, body);
  for (const bool tips : {false, true})
    for (const std::uint32_t n : order_.needles()) add_needle(instruments, n, tips, body);
}

void TickLandmarks::add_anchors(const Instruments& instruments) noexcept {
  for (Vec3 anchor : anchors_.positions())
    if (keep_clear(anchor, instruments)) set_.add(anchor, Vec3::Zero(), {});
  set_.anchors = set_.positions.size();
}

// Moves an anchor aside that lies in a needle's path: if it were left out once the tip comes near, displacement and
// force would jump. False where several needles leave no position for it.
bool TickLandmarks::keep_clear(Vec3& anchor, const Instruments& instruments) const noexcept {
  for (const NeedleContact& needle : instruments.needles()) {
    if (needle.landmarks().empty()) continue;
    const Vec3 on_line = needle.nearest_on_line(anchor), aside = anchor - on_line;
    const double distance = aside.norm();
    if (distance >= anchor_clearance_) continue;
    const Vec3 direction = distance > 0 ? Vec3(aside / distance) : needle.axis().unitOrthogonal();
    anchor = on_line + anchor_clearance_ * direction;
  }
  return std::ranges::none_of(instruments.needles(), [&](const NeedleContact& needle) {
    return std::ranges::any_of(needle.landmarks(), [&](const NeedleLandmark& landmark) {
      return (landmark.position - anchor).norm() < 0.5 * anchor_clearance_;
    });
  });
}

void TickLandmarks::add_probe(Instruments& instruments, const BodyMotion& body) noexcept {
  if (!instruments.probe()) return;
  const auto owner = static_cast<std::uint32_t>(instruments.needles().size());
  std::uint32_t i = 0;
  for (NeedleLandmark& landmark : instruments.probe()->landmarks())
    add(landmark, landmark.spread, {owner, i++}, -1, body);
}

// The landmark of its tip, or those of its shaft.
void TickLandmarks::add_needle(Instruments& instruments, std::size_t n, bool tip,
                               const BodyMotion& body) noexcept {
  NeedleContact& needle = instruments.needles()[n];
  const std::span<NeedleLandmark> of_needle = needle.landmarks();
  for (std::size_t i = 0; i < of_needle.size(); ++i) {
    if ((needle.has_tip_landmark() && i + 1 == of_needle.size()) != tip) continue;
    LandmarkSpread spread = of_needle[i].spread;
    if (tip)
      spread.behind = last_on_shaft_[n];
    else
      last_on_shaft_[n] = static_cast<std::int32_t>(set_.positions.size());
    add(of_needle[i], spread, {static_cast<std::uint32_t>(n), static_cast<std::uint32_t>(i)}, beams_[n],
        body);
  }
}

void TickLandmarks::add(NeedleLandmark& landmark, const LandmarkSpread& spread, LandmarkSet::Owner owner,
                        std::int32_t beam, const BodyMotion& body) noexcept {
  LandmarkCompliance::Point point{.beam = beam, .arc_mm = landmark.arc_mm};
  if (landmark.slides && gives_way_) point.slides_on = landmark.axis;
  if (body.compliance()) {
    // Where it would go if the tissue were rigid: from where the body is now.
    point.arm = landmark.position + landmark.if_stuck - body.pivot();
    landmark.body = LandmarkCompliance::moved_by(body.motion(), point.arm);
    landmark.if_stuck += landmark.body;
  }
  set_.add(landmark.position, landmark.if_stuck, spread, point);
  set_.owners.push_back(owner);
}

}  // namespace brachy
