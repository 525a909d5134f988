#include "apps/brachy/replay/replay_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/reports/certificate_report.h"

namespace brachy {
namespace {

std::uint64_t ticks_of(const Simulator& simulator, Evaluation evaluation) {
  return simulator.evaluation_counts()[static_cast<std::size_t>(evaluation)];
}

std::string percent(double share) {
  return std::isnan(share) ? "none" : fmt::format("{:.0f} %", 100 * share);
}

nlohmann::ordered_json json_of(const ForcePeaks& peaks, const ForceWork& work) {
  const NeedleForces& deepest = peaks.deepest().forces;
  return {
      {"max_depth_mm", peaks.depth_mm()},
      {"peak_out_n", peaks.out_n()},
      {"peak_in_n", peaks.in_n()},
      {"peak_lateral_n", peaks.lateral_n()},
      {"puncture_n", peaks.puncture_n()},
      {"axial_at_deepest_n", deepest.axial_n},
      {"cutting_share_at_deepest", share_of(deepest.cutting_n, deepest.axial_n)},
      {"friction_share_at_deepest", share_of(deepest.friction_n, deepest.axial_n)},
      {"insertion_work_nmm", work.insertion_nmm()},
      {"cutting_share_of_work", share_of(work.cutting_nmm(), work.insertion_nmm())},
      {"friction_share_of_work", share_of(work.friction_nmm(), work.insertion_nmm())},
      {"hand_work_nmm", work.hand_nmm()},
      {"max_tip_deflection_mm", peaks.tip_deflection_mm()},
  };
}

// A needle of 1.3 mm that is held 100 mm away bends by 1 mm under 0.1 N (3 EI/l³).
constexpr double kNoNeedleBearsN = 10;

std::string bending_of(const ForcePeaks& peaks) {
  if (peaks.tip_deflection_mm() > 0)
    return fmt::format("  bent: tip deflected by at most {:.2f} mm\n", peaks.tip_deflection_mm());
  if (peaks.lateral_n() < kNoNeedleBearsN) return "";
  return fmt::format(
      "  rigid: {:.0f} N across would bend any needle; [needle] flexible = true lets it bend\n",
      peaks.lateral_n());
}

std::string text_of(const ForcePeaks& peaks, const ForceWork& work) {
  const NeedleForces& deepest = peaks.deepest().forces;
  return fmt::format(
      "  force: at most {:.2f} N out, {:.2f} N in, {:.2f} N across; puncture {}\n"
      "  at {:.1f} mm, its deepest: {:.2f} N, cutting {}, friction {}\n"
      "  work: {:.1f} N·mm going in, cutting {}, friction {}; {:.1f} N·mm by the hand in all\n{}",
      peaks.out_n(), peaks.in_n(), peaks.lateral_n(),
      std::isnan(peaks.puncture_n()) ? "none" : fmt::format("at {:.2f} N", peaks.puncture_n()),
      peaks.depth_mm(), deepest.axial_n, percent(share_of(deepest.cutting_n, deepest.axial_n)),
      percent(share_of(deepest.friction_n, deepest.axial_n)), work.insertion_nmm(),
      percent(share_of(work.cutting_nmm(), work.insertion_nmm())),
      percent(share_of(work.friction_nmm(), work.insertion_nmm())), work.hand_nmm(), bending_of(peaks));
}

}  // namespace

ReplayTally::ReplayTally(const std::vector<std::uint32_t>& needles) {
  for (std::uint32_t id : needles) {
    needles_.emplace_back();
    needles_.back().id = id;
  }
}

void ReplayTally::add(double t_s, const MeshState& state, bool finite) {
  ++ticks_;
  const TickSummary& summary = state.summary;
  certificates_.add(summary, finite);
  max_displacement_ = std::max(max_displacement_, summary.max_displacement_mm);
  max_moved_ = std::max(max_moved_, summary.moved_vertices);
  all_flags_ |= summary.step_flags;
  seeds_ = state.seeds.count;
  in_contact_ += summary.landmark_count > 0;
  for (Needle& needle : needles_) {
    const NeedleState& now = state.needles.states[needle.id];
    needle.contact = now.contact;
    needle.punctures = now.puncture_count;
    if (!now.present) {
      needle.work.leave();
      continue;
    }
    needle.peaks.add(force_sample(t_s, needle.id, now, summary.certificate.vertex_det));
    needle.work.add(now, (summary.step_flags & kStepReinitialized) != 0);
  }
}

std::uint32_t ReplayTally::punctures() const {
  std::uint32_t count = 0;
  for (const Needle& needle : needles_) count += needle.punctures;
  return count;
}

double ReplayTally::dissipated_nmm() const {
  double work = 0;
  for (const Needle& needle : needles_) {
    const bool out = needle.contact == ContactState::kFree || needle.contact == ContactState::kWithdrawn;
    work += out ? needle.work.hand_nmm() : ForcePeaks::kNone;
  }
  return work;
}

double ReplayTally::max_depth_mm() const {
  double depth = 0;
  for (const Needle& needle : needles_) depth = std::max(depth, needle.peaks.depth_mm());
  return depth;
}

std::string ReplayTally::to_json(const Simulator& simulator, const std::string& state_hash) const {
  nlohmann::ordered_json json = {
      {"ticks", ticks_},
      {"state_hash", state_hash},
      {"points", simulator.tissue().size()},
      {"max_disp_mm", max_displacement_},
      {"max_depth_mm", max_depth_mm()},
      {"moved", max_moved_},
      {"ticks_in_contact", in_contact_},
      {"punctures", punctures()},
      {"seeds", seeds_},
      {"dissipated_nmm", dissipated_nmm()},
      {"contact", to_string(needles_.front().contact)},
      {"simd", to_string(simulator.simd_target())},
      {"ticks_idle", ticks_of(simulator, Evaluation::kIdle)},
      {"ticks_direct", ticks_of(simulator, Evaluation::kDirect)},
      {"ticks_mixed", ticks_of(simulator, Evaluation::kMixed)},
      {"ticks_condensed", ticks_of(simulator, Evaluation::kCondensed)},
      {"solve_failed", (all_flags_ & kStepSolveFailed) != 0},
      {"saturated", (all_flags_ & kStepSaturated) != 0},
      {"reinitialized", (all_flags_ & kStepReinitialized) != 0},
  };
  add_to_json(json, "ticks", certificates_);
  for (const Needle& needle : needles_) {
    nlohmann::ordered_json one = {
        {"needle", needle.id}, {"contact", to_string(needle.contact)}, {"punctures", needle.punctures}};
    one.update(json_of(needle.peaks, needle.work));
    json["needles"].push_back(std::move(one));
  }
  return json.dump() + "\n";
}

std::string ReplayTally::to_text(const Simulator& simulator, const std::string& state_hash) const {
  std::string text = fmt::format(
      "{} ticks of {} points, {} in contact, {} punctures{}\n"
      "largest displacement {:.3f} mm, at most {} points moved; {}{}{}{}\n",
      ticks_, simulator.tissue().size(), in_contact_, punctures(),
      seeds_ ? fmt::format(", {} seeds dropped", seeds_) : "", max_displacement_, max_moved_,
      std::isnan(dissipated_nmm()) ? "tissue not at rest in the end"
                                   : fmt::format("{:.1f} N·mm dissipated", dissipated_nmm()),
      all_flags_ & kStepSolveFailed ? "; a solve FAILED" : "",
      all_flags_ & kStepSaturated ? "; a landmark was held at its limit" : "",
      all_flags_ & kStepReinitialized ? "; a needle jumped" : "");
  for (const Needle& needle : needles_)
    text += fmt::format("needle {}: ends {}, {} punctures\n", needle.id, to_string(needle.contact),
                        needle.punctures) +
            text_of(needle.peaks, needle.work);
  return text + fmt::format("fields: {} idle, {} direct, {} mixed, {} condensed, on {}\n{}state hash {}\n",
                            ticks_of(simulator, Evaluation::kIdle), ticks_of(simulator, Evaluation::kDirect),
                            ticks_of(simulator, Evaluation::kMixed),
                            ticks_of(simulator, Evaluation::kCondensed), to_string(simulator.simd_target()),
                            brachy::to_text("ticks", certificates_), state_hash);
}

}  // namespace brachy
