#include "core/brachytherapy/seeds/seed_loading.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace brachy {

SeedLoading::SeedLoading(const SeedSettings& settings, const TemplateGrid& grid,
                         const std::optional<Plan>& plan, std::size_t needles)
    : settings_(settings), grid_(grid), held_(needles) {
  if (!plan) return;
  plan_ = LoadingPlan(*plan, grid);
  plan_.reserve();
  is_gone_.reserve(LoadingPlan::kMostSeeds);
  is_gone_.assign(plan_.seeds.size(), 0);
}

void SeedLoading::set_plan(const LoadingPlan& plan) noexcept {
  if (plan_.needle_count() == 0 || plan.seeds.size() > LoadingPlan::kMostSeeds) return;
  plan_ = plan;
  is_gone_.resize(plan_.seeds.size(), 0);
  for (Held& held : held_) {
    if (held.carried && !plan_.is_in_use(*held.carried)) {
      held.carried.reset();
      held.is_loaded_for_press = false;
    }
    if (held.plan_needle && !plan_.is_in_use(*held.plan_needle)) held.plan_needle.reset();
  }
}

void SeedLoading::update(std::size_t n, const NeedlePose& pose, bool is_in_tissue,
                         const Vec3& tip_deflection) noexcept {
  Held& held = held_[n];
  held.request_failed = false;
  held.waits = false;
  if (pose.load_number != held.load_number) {
    held.load_number = pose.load_number;
    load(n, pose.load);
  }
  if (!pose.present) return;
  const Vec3 tip = pose.X_WN.p + tip_deflection;
  held.last_tip = held.is_known ? held.tip : tip;
  held.is_known = true;
  held.tip = tip;
  held.was_out |= tip.z() < grid_.origin_mm.z();
  held.was_free |= !is_in_tissue;
  const bool was_held = held.button;
  held.button = pose.button;
  if (held.button && !was_held) press(held, pose.X_WN);
  if (!held.button && is_train()) held.plan_needle.reset();
}

void SeedLoading::load(std::size_t n, std::int32_t plan_needle) noexcept {
  Held& held = held_[n];
  held.carried.reset();
  held.plan_needle.reset();
  held.is_loaded_for_press = false;
  if (plan_needle < 0) return;
  const auto wanted = static_cast<std::size_t>(plan_needle);
  const bool is_there =
      plan_.is_in_use(wanted) && first_remaining(wanted) < plan_.seeds.size() &&
      std::ranges::none_of(held_, [wanted](const Held& other) { return other.carried == wanted; });
  held.request_failed = !is_there;
  if (!is_there) return;
  held.carried = wanted;
  held.is_loaded_for_press = true;
}

// The pose's line tells the hole: where a needle bends, its tip is beside it.
void SeedLoading::press(Held& held, const RigidTransform& X_WN) noexcept {
  const Vec3 axis = X_WN.R.col(2);
  held.has_refused = false;
  if (!is_train()) {
    if (first_remaining(held.carried) == plan_.seeds.size()) held.carried.reset();
    held.plan_needle = held.carried ? held.carried : plan_needle_at(X_WN.p, axis);
    held.is_asked = true;
    return;
  }
  const Hole hole = hole_at(X_WN.p, axis);
  if (std::exchange(held.is_loaded_for_press, false)) {
    held.hole = hole;
  } else if (!held.carried || held.was_out || (held.was_free && hole != held.hole)) {
    held.carried.reset();  // an untouched one can be handed out again
    held.carried = train_for(X_WN.p, axis);
    held.hole = hole;
  }
  held.was_out = held.was_free = false;
  held.plan_needle = held.carried;
  const std::size_t first = first_remaining(held.plan_needle);
  held.request_failed = first == plan_.seeds.size();
  if (held.request_failed) return held.plan_needle.reset();
  // A whole train lies as planned; the rest of one that was begun has been pushed to the tip by the stylet.
  const bool is_whole = first == plan_.first_of_needle[*held.plan_needle];
  held.pushed_mm = is_whole ? 0 : plan_.seeds[first].offset_mm - 0.5 * PlanNeedle::kSeedMm;
  held.press_tip = held.tip;
  held.axis = X_WN.R.col(2);
}

// The plan's needle whose hole the line passes within half a spacing, in x and in y.
std::optional<std::size_t> SeedLoading::plan_needle_at(const Vec3& tip, const Vec3& axis) const noexcept {
  const Vec3 met = tip + (grid_.origin_mm.z() - tip.z()) / axis.z() * axis;
  for (std::size_t n = 0; n < plan_.needle_count(); ++n) {
    if (plan_.is_withdrawn[n]) continue;
    const Vec3 off = (met - plan_.tips[n]).cwiseAbs();
    if (std::max(off.x(), off.y()) < 0.5 * grid_.spacing_mm)
      return n;  // false where the line is parallel to the template
  }
  return {};
}

SeedLoading::Hole SeedLoading::hole_at(const Vec3& tip, const Vec3& axis) const noexcept {
  const Vec3 met = tip + (grid_.origin_mm.z() - tip.z()) / axis.z() * axis;
  return {std::round((met.x() - grid_.origin_mm.x()) / grid_.spacing_mm),
          std::round((met.y() - grid_.origin_mm.y()) / grid_.spacing_mm)};
}

std::optional<std::size_t> SeedLoading::train_for(const Vec3& tip, const Vec3& axis) const noexcept {
  if (settings_.loading == "hole")
    if (const auto planned_here = plan_needle_at(tip, axis)) return planned_here;
  for (std::size_t n = 0; n < plan_.needle_count(); ++n) {
    if (plan_.is_withdrawn[n]) continue;
    const bool is_untouched =
        std::none_of(is_gone_.begin() + static_cast<std::ptrdiff_t>(plan_.first_of_needle[n]),
                     is_gone_.begin() + static_cast<std::ptrdiff_t>(plan_.first_of_needle[n + 1]),
                     [](char gone) { return gone != 0; });
    if (is_untouched && std::ranges::none_of(held_, [n](const Held& held) { return held.carried == n; }))
      return n;
  }
  return {};
}

std::size_t SeedLoading::first_remaining(const std::optional<std::size_t>& plan_needle) const noexcept {
  if (!plan_needle) return plan_.seeds.size();
  for (std::size_t i = plan_.first_of_needle[*plan_needle]; i < plan_.first_of_needle[*plan_needle + 1]; ++i)
    if (!is_gone_[i]) return i;
  return plan_.seeds.size();
}

std::optional<SeedDrop> SeedLoading::due(std::size_t n) const noexcept {
  const Held& held = held_[n];
  if (held.waits || !(is_train() ? held.plan_needle.has_value() : held.is_asked)) return {};
  const std::size_t next = first_remaining(held.plan_needle);
  if (next == plan_.seeds.size()) {
    if (is_train()) return {};
    return SeedDrop{Seed::kUnplanned, settings_.source, settings_.air_kerma_strength_u, held.tip};
  }
  const PlannedSeed& seed = plan_.seeds[next];
  SeedDrop drop{static_cast<std::int32_t>(next), seed.source, seed.air_kerma_strength_u, held.tip};
  if (!is_train()) return drop;
  const auto retracted = [&](const Vec3& tip) { return (held.press_tip - tip).dot(held.axis); };
  const double due_at = seed.offset_mm - held.pushed_mm, now = retracted(held.tip),
               before = retracted(held.last_tip);
  if (now < due_at) return {};
  // The tip passed it between two ticks: it is dropped at the interpolated position.
  if (before < due_at)
    drop.at = held.last_tip + (due_at - before) / (now - before) * (held.tip - held.last_tip);
  return drop;
}

void SeedLoading::dropped(std::size_t n) noexcept {
  Held& held = held_[n];
  if (const auto drop = due(n); drop && drop->planned >= 0) mark_dropped(drop->planned);
  held.is_asked = false;
  held.has_refused = false;
}

bool SeedLoading::refused(std::size_t n) noexcept {
  Held& held = held_[n];
  held.is_asked = false;
  held.waits = true;
  const bool is_news = !held.has_refused;
  held.has_refused = true;
  return is_news;
}

void SeedLoading::mark_dropped(std::int32_t planned) noexcept {
  if (planned >= 0 && static_cast<std::size_t>(planned) < is_gone_.size())
    is_gone_[static_cast<std::size_t>(planned)] = 1;
}

}  // namespace brachy
