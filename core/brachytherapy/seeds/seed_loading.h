#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/seeds/seed_drop.h"
#include "core/brachytherapy/seeds/seed_settings.h"
#include "core/needle/needle_pose.h"

namespace brachy {

/// The seeds in the needles, and when their devices' buttons drop them. A device needle is identified with the plan
/// needle of the template hole through which its line passes when the button is pressed.
///
/// Applicator "single": each press drops one seed at the tip: the plan needle's next one, from the tip backwards, or
/// one with the scene's settings where the plan has none left there, or there is no plan.
/// Applicator "train": from the press to the release the stylet holds the plan needle's seeds where they are in the
/// world; drawn back over them by its own length of seeds and spacers, the needle drops one after the other with
/// its centre at the tip. Released early, the rest is pushed to the tip again at the next press.
/// Threads: one. Real-time: no allocation after construction.
class SeedLoading {
 public:
  /// `plan`: none where the scene has none; then a train drops nothing.
  SeedLoading(const SeedSettings& settings, const TemplateGrid& grid, const std::optional<Plan>& plan,
              std::size_t needles);

  /// Updates needle n with its pose of this tick, and how far its tip is off it, mm, where it bends.
  void update(std::size_t n, const NeedlePose& pose, const Vec3& tip_deflection = Vec3::Zero()) noexcept;
  /// The next seed that needle n is to drop in this tick; none: no (further) seed.
  std::optional<SeedDrop> due(std::size_t n) const noexcept;
  /// Whether a seed was requested from needle n and there is none. True once per request.
  bool request_failed(std::size_t n) const noexcept { return held_[n].request_failed; }

  /// The seed that due() returned has been dropped.
  void dropped(std::size_t n) noexcept;
  /// The seed could not be dropped. A train retries in every tick while the button is held; true for the first refusal.
  bool refused(std::size_t n) noexcept;
  /// A planned seed was dropped earlier: it is no longer in its needle.
  void mark_dropped(std::int32_t planned) noexcept;

 private:
  struct Held {             // one device needle
    bool is_known = false;  // its first pose has arrived
    bool button = false;
    bool is_asked = false;  // single: a press that is still to be served
    bool request_failed = false;
    bool waits = false;                      // drops no more in this tick
    bool has_refused = false;                // since the last seed or press
    std::optional<std::size_t> plan_needle;  // train: while the stylet holds
    double pushed_mm = 0;                    // train: how far the stylet has pushed the remaining seeds
    Vec3 press_tip = Vec3::Zero(), axis = Vec3::UnitZ();
    Vec3 last_tip = Vec3::Zero(), tip = Vec3::Zero();
  };
  void press(Held& held, const RigidTransform& X_WN) noexcept;
  std::optional<std::size_t> plan_needle_at(const Vec3& tip, const Vec3& axis) const noexcept;
  /// The needle's first seed that is still in it; planned_.size() where there is none.
  std::size_t first_remaining(const std::optional<std::size_t>& plan_needle) const noexcept;
  bool is_train() const { return settings_.applicator == "train"; }

  SeedSettings settings_;
  TemplateGrid grid_;
  std::vector<PlannedSeed> planned_;
  std::vector<std::size_t> first_of_needle_;  // in planned_, and its end
  std::vector<Vec3> holes_;                   // of the plan's needles; only x and y are used
  std::vector<char> is_gone_;                 // by planned
  std::vector<Held> held_;                    // by device needle
};

}  // namespace brachy
