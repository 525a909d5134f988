#include "apps/daemon/telemetry/guard_events.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

namespace brachy {
namespace {

constexpr std::uint32_t kActions = kStepSubstepped | kStepClamped | kStepMerged | kStepDropped |
                                   kStepSolveFailed | kStepSlipUnsettled | kStepSteep;

std::string actions_of(const TickSummary& tick) {
  const Certificate& c = tick.certificate;
  std::vector<std::string> parts;
  const auto add = [&](StepFlag flag, std::string text) {
    if (tick.step_flags & flag) parts.push_back(std::move(text));
  };
  add(kStepSubstepped, fmt::format("sub-steps: {}", c.substeps));
  add(kStepClamped, fmt::format("landmarks clamped {:.1f} mm{}", c.held_mm,
                                std::isfinite(c.held_n) ? fmt::format(" ({:.2f} N)", c.held_n) : ""));
  add(kStepMerged, "landmarks merged");
  add(kStepDropped, "landmarks left out");
  add(kStepSolveFailed, "landmarks not solved: the last field stands");
  add(kStepSlipUnsettled, "stick and slip not settled");
  add(kStepSteep, "a needle bends by more than 8°");
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string verdict_of(const TickSummary& tick) {
  const Vec3& p = tick.certificate.place;
  switch (tick.certificate.verdict) {
    case Verdict::kInjective:
      return "injective again";
    case Verdict::kFolded:
      return fmt::format("field folds at ({:.1f}, {:.1f}, {:.1f}) mm", p.x(), p.y(), p.z());
    case Verdict::kUnknown:
      break;
  }
  return "not known whether the field folds";
}

}  // namespace

std::optional<std::string> GuardEvents::update(const TickSummary& tick) {
  const Guard now{tick.certificate.verdict, tick.step_flags & kActions};
  if (now != seen_) ++passed_over_;
  seen_ = now;
  if (now == reported_ || !rate_.pass(std::llround(tick.sim_time_s * 1e9))) return {};

  // While the guard acts on an injective field, only its actions are reported; the verdict only if it
  // changed.
  const bool verdict_is_news =
      now.verdict != Verdict::kInjective || now.verdict != reported_.verdict || now.actions == 0;
  std::string text = verdict_is_news ? verdict_of(tick) : "";
  if (now.actions != 0) text += (text.empty() ? "" : ", ") + actions_of(tick);
  if (passed_over_ > 1) text += fmt::format(" ({} changes before it not reported)", passed_over_ - 1);
  passed_over_ = 0;
  reported_ = now;
  return text;
}

}  // namespace brachy
