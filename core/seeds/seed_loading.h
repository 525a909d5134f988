#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/plan/plan.h"
#include "core/plan/template_grid.h"
#include "core/seeds/seed.h"
#include "core/seeds/seed_drop.h"
#include "core/seeds/seed_settings.h"
#include "core/sim/needle_pose.h"

namespace brachy {

/// What the needles hold and when they let go of it, by their devices' buttons. The plan needle that a device needle is, is
/// that of the template's hole which its line passes when the button is pressed.
///
/// Applicator "single": each press drops one seed at the tip: the plan needle's next one, from the tip backwards, or one of
/// the scene's own where the plan has none left there, or there is no plan.
/// Applicator "train": from the press to the release the stylet holds the plan needle's seeds where they are in the world;
/// drawn back over them by its own length of seeds and spacers, the needle lets one after the other fall with its centre at
/// the tip. Released early, the rest is pushed to the tip again at the next press.
/// Threads: one. Real-time: no allocation after construction.
class SeedLoading {
 public:
  /// `plan`: none where the scene has none; then nothing falls from a train.
  SeedLoading(const SeedSettings& settings, const TemplateGrid& grid, const std::optional<Plan>& plan,
              std::size_t needles);

  /// Takes needle n's pose of this tick.
  void update(std::size_t n, const NeedlePose& pose) noexcept;
  /// The next seed that needle n is to let go of in this tick; nothing: none (any more).
  std::optional<SeedDrop> due(std::size_t n) const noexcept;
  /// Whether needle n was asked for a seed that there is not. Once for each time.
  bool asked_in_vain(std::size_t n) const noexcept { return held_[n].asked_in_vain; }

  /// The seed that due() tells has fallen.
  void dropped(std::size_t n) noexcept;
  /// It could not fall. A train tries it again in every tick while the button is held; true if this is news.
  bool refused(std::size_t n) noexcept;
  /// A planned seed has fallen before: it is not there any more.
  void take_out(std::int32_t planned) noexcept;

 private:
  struct Held {             // one device needle
    bool is_known = false;  // it has been seen
    bool button = false;
    bool is_asked = false;  // single: a press that has not been answered
    bool asked_in_vain = false;
    bool waits = false;                      // no more of it in this tick
    bool has_refused = false;                // since the last seed or press
    std::optional<std::size_t> plan_needle;  // train: while the stylet holds
    double pushed_mm = 0;                    // train: how far the stylet has pushed what is left
    Vec3 press_tip = Vec3::Zero(), axis = Vec3::UnitZ();
    Vec3 last_tip = Vec3::Zero(), tip = Vec3::Zero();
  };
  void press(Held& held, const Vec3& axis) noexcept;
  std::optional<std::size_t> plan_needle_at(const Vec3& tip, const Vec3& axis) const noexcept;
  /// Its first seed that is not gone; planned_.size() where there is none.
  std::size_t first_left(const std::optional<std::size_t>& plan_needle) const noexcept;
  bool is_train() const { return settings_.applicator == "train"; }

  SeedSettings settings_;
  TemplateGrid grid_;
  std::vector<PlannedSeed> planned_;
  std::vector<std::size_t> first_of_needle_;  // in planned_, and its end
  std::vector<Vec3> holes_;                   // of the plan's needles; x and y count
  std::vector<char> is_gone_;                 // by planned
  std::vector<Held> held_;                    // by device needle
};

}  // namespace brachy
