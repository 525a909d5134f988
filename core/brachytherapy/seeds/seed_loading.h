#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/seeds/loading_plan.h"
#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/seeds/seed_drop.h"
#include "core/brachytherapy/seeds/seed_settings.h"
#include "core/needle/needle_pose.h"

namespace brachy {

/// The seeds in the needles, and when their devices' buttons drop them.
///
/// Applicator "single", a magazine: each press drops one seed at the tip: the next one, from the tip backwards, of the
/// plan needle of the template hole through which the needle's line passes, or one with the scene's settings where the
/// plan has none left there, or there is no plan.
/// Applicator "train": from the press to the release the stylet holds the train that the needle carries where it is in
/// the world; drawn back over it by its length of seeds and spacers, the needle drops one seed after the other with its
/// centre at the tip. Released early, the rest is pushed to the tip again at the next press.
/// A needle is loaded (SeedSettings::loading) at its first press, and carries that train through whichever hole the
/// hand chooses, until it is put aside: drawn back through the template, or, out of the tissue, moved to another hole.
/// An operator may load it as another of the plan's needles (NeedlePose::load), also a magazine: then it gives that
/// needle's seeds wherever it is, a train until it is put aside after its first press, a magazine until it is empty.
/// Threads: one. Real-time: no allocation after construction.
class SeedLoading {
 public:
  /// `plan`: none where the scene has none; then a train drops nothing.
  SeedLoading(const SeedSettings& settings, const TemplateGrid& grid, const std::optional<Plan>& plan,
              std::size_t needles);

  /// Another plan from now on, which has all needles of the one before, by the same numbers, and perhaps more. What has
  /// left its needle stays known; a needle that carries a train which is no longer planned carries none.
  /// Does nothing where there was no plan at construction, or `plan` has more than LoadingPlan::kMostSeeds.
  void set_plan(const LoadingPlan& plan) noexcept;

  /// Updates needle n with its pose of this tick, whether it is in the tissue, and how far its tip is off the pose,
  /// mm, where it bends.
  void update(std::size_t n, const NeedlePose& pose, bool is_in_tissue = false,
              const Vec3& tip_deflection = Vec3::Zero()) noexcept;
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

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(plan_, is_gone_, held_);
  }

 private:
  using Hole = std::array<double, 2>;  // column and row, whole numbers; also beside the template
  struct Held {                        // one device needle
    bool is_known = false;             // its first pose has arrived
    bool button = false;
    bool is_asked = false;  // single: a press that is still to be served
    bool request_failed = false;
    bool waits = false;                      // drops no more in this tick
    bool has_refused = false;                // since the last seed or press
    std::optional<std::size_t> plan_needle;  // whose seeds are to fall; train: while the stylet holds
    std::optional<std::size_t> carried;  // the plan needle that it was loaded as; magazine: by an operator
    bool is_loaded_for_press = false;    // train: by an operator, and not pressed since
    Hole hole{};                         // when it was loaded
    bool was_out = false;                // since the last press: of the template
    bool was_free = false;               // since the last press: of the tissue
    std::uint32_t load_number = 0;       // of the last request to load it that was carried out
    double pushed_mm = 0;                // train: how far the stylet has pushed the remaining seeds
    Vec3 press_tip = Vec3::Zero(), axis = Vec3::UnitZ();
    Vec3 last_tip = Vec3::Zero(), tip = Vec3::Zero();

    template <class Archive>
    void list_state(Archive& archive) {
      archive(is_known, button, is_asked, request_failed, waits, has_refused, plan_needle, carried,
              is_loaded_for_press, hole, was_out, was_free, load_number, pushed_mm, press_tip, axis, last_tip,
              tip);
    }
  };
  void press(Held& held, const RigidTransform& X_WN) noexcept;
  void load(std::size_t n, std::int32_t plan_needle) noexcept;
  Hole hole_at(const Vec3& tip, const Vec3& axis) const noexcept;
  std::optional<std::size_t> train_for(const Vec3& tip, const Vec3& axis) const noexcept;
  std::optional<std::size_t> plan_needle_at(const Vec3& tip, const Vec3& axis) const noexcept;
  /// The needle's first seed that is still in it; planned_.size() where there is none.
  std::size_t first_remaining(const std::optional<std::size_t>& plan_needle) const noexcept;
  bool is_train() const { return settings_.applicator == "train"; }

  SeedSettings settings_;
  TemplateGrid grid_;
  LoadingPlan plan_;
  std::vector<char> is_gone_;  // by planned seed
  std::vector<Held> held_;     // by device needle
};

}  // namespace brachy
