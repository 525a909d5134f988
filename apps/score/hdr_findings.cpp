#include "apps/score/hdr_findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/score/cause_text.h"
#include "apps/score/explanation/explanation.h"

namespace brachy {
namespace {

using Kind = Cause::Kind;

constexpr double kLeastHdrHarmPercent = 0.5;
constexpr double kMissingMm = 10;  // what a dwell position that is not there counts as, for the order alone

class HdrMistakes {
 public:
  HdrMistakes(const HdrPlan& plan, const TemplateGrid& grid,
              const std::vector<const CatheterCourse*>& courses, const std::vector<Structure>& structures,
              const DoseSettings& settings)
      : plan_(plan), courses_(courses), delivered_(structures, settings), planned_(plan.dwells(grid)) {
    deviations_.hole_spacing_mm = grid.spacing_mm;
    for (std::size_t c = 0; c < plan.catheters.size(); ++c)
      deviations_.tips.push_back(plan.planned_tip(grid, c));
    for (std::size_t i = 0; i < planned_.size(); ++i) {
      const Dwell& dwell = planned_[i];
      const CatheterCourse* course = courses[dwell.catheter];
      if (!course) continue;
      const double offset = plan.offset_mm(dwell.catheter, dwell.index);
      const Vec3 now = dwell_at(course->now, offset).position;
      Dwell rest = dwell_at(course->rest, offset);
      rest.seconds = dwell.seconds;
      deviations_.seeds.push_back({.index = i,
                                   .needle = dwell.catheter,
                                   .offset_mm = offset,
                                   .planned = dwell.position,
                                   .dropped = now - dwell.position,
                                   .moved = rest.position - now});
      at_rest_.push_back(as_seed(rest, plan.source, plan.source_strength_u));
      delivered_.add(at_rest_.back());
    }
    as_is_ = delivered_.evaluate();
  }

  std::vector<Finding> find(const std::vector<std::uint32_t>& unplanned) && {
    const Explanation explanation = explain(deviations_);
    for (const Cause& cause : explanation.causes) tell(cause);
    missing();
    if (!unplanned.empty())
      found_.push_back(
          {.text = fmt::format(
               "{} where the plan has no catheter: {} no source",
               unplanned.size() == 1 ? "1 needle lies" : fmt::format("{} needles lie", unplanned.size()),
               unplanned.size() == 1 ? "it gets" : "they get"),
           .cause = "unplanned",
           .weight = kMissingMm * static_cast<double>(unplanned.size())});
    std::ranges::stable_sort(found_, std::greater(), [](const Finding& f) {
      return std::pair(std::round(10 * f.harm_percent), f.weight);
    });
    return std::move(found_);
  }

 private:
  void add(const char* cause, double weight, std::string text, const std::vector<DoseSeed>& taken,
           const std::vector<DoseSeed>& given, std::vector<std::size_t> catheters) {
    ImplantDose dose = delivered_;
    for (DoseSeed seed : taken) {
      seed.air_kerma_strength_u = -seed.air_kerma_strength_u;
      dose.add(seed);
    }
    for (const DoseSeed& seed : given) dose.add(seed);
    const DoseChange cost = dose_change(dose.evaluate(), as_is_);
    Finding finding{.text = std::move(text), .cause = cause, .weight = weight};
    finding.text += cost_text(cost);
    if (const double harm = cost.harm_percent(plan_.prescription_gy); harm > kLeastHdrHarmPercent)
      finding.harm_percent = harm;
    finding.cost = cost;
    finding.needles = std::move(catheters);
    found_.push_back(std::move(finding));
  }

  void tell(const Cause& cause) {
    std::vector<DoseSeed> taken, given;
    double weight = 0;
    for (const std::size_t i : cause.seeds) {
      taken.push_back(at_rest_[i]);
      given.push_back(at_rest_[i]);
      given.back().position -= cause.part[i];
      weight += cause.part[i].norm();
    }
    add(name_of(cause.kind), weight, text(cause), taken, given,
        cause.is_of_all ? std::vector<std::size_t>() : cause.needles);
  }

  std::string text(const Cause& cause) const {
    const double across = cause.shift.head<2>().norm(), along = cause.shift.z();
    const bool is_one = cause.needles.size() == 1;
    const std::string who = cause.is_of_all ? "all catheters" : counted(cause.needles.size(), "catheter");
    const std::string which = cause.is_of_all ? "" : ": " + names(cause.needles);
    const std::string where = fmt::format("(x {:+.1f}, y {:+.1f})", cause.shift.x(), cause.shift.y());
    switch (cause.kind) {
      case Kind::kAside:
      case Kind::kElsewhere:
        return fmt::format("{} {} {:.1f} mm aside {}{}", who, is_one ? "lies" : "lie", across, where, which);
      case Kind::kTurned:
        return fmt::format("{} are turned together by {:.1f}°{}", who,
                           std::abs(cause.angle) * 180 / std::numbers::pi, which);
      case Kind::kMirrored:
        return fmt::format("left and right were exchanged for {}{}", who, which);
      case Kind::kExchanged:
        return fmt::format("{} were exchanged: each lies where another was planned{}", who, which);
      case Kind::kDepth:
        return fmt::format("{} {:.1f} mm too {}{}", who, std::abs(along), along < 0 ? "shallow" : "deep",
                           which);
      case Kind::kScatterAcross:
      case Kind::kScatterAlong:
        return fmt::format("catheters scatter {} with a standard deviation of {:.1f} mm",
                           cause.kind == Kind::kScatterAlong ? "along" : "across", cause.shift.z());
      case Kind::kSwelling:
        return fmt::format(
            "the gland is swollen by {:.0f} % each way: in the tissue at rest the dwell positions lie "
            "closer together",
            100 * cause.slope);
      case Kind::kSpacing:
      case Kind::kFront:
      case Kind::kBack:
      case Kind::kSeeds:
        return fmt::format("{} {} bent, its dwell positions up to {:.1f} mm away{}", who,
                           is_one ? "is" : "are", largest(cause), which);
      case Kind::kGland:
      case Kind::kPushed:
      case Kind::kDragged:
      case Kind::kUnpunctured:
        return fmt::format(
            "the gland lies up to {:.1f} mm from its rest under {}: the tissue that gets the dose is "
            "another{}",
            largest(cause), who, which);
    }
    return {};
  }

  static double largest(const Cause& cause) {
    double most = 0;
    for (const Vec3& part : cause.part) most = std::max(most, part.norm());
    return most;
  }

  std::string names(const std::vector<std::size_t>& catheters) const {
    std::vector<std::string> all;
    for (const std::size_t c : catheters) all.push_back(plan_.catheters[c].label());
    return joined(all);
  }

  void missing() {
    std::vector<std::size_t> without;
    std::vector<DoseSeed> given;
    for (std::size_t c = 0; c < courses_.size(); ++c)
      if (!courses_[c]) without.push_back(c);
    if (without.empty()) return;
    for (const Dwell& dwell : planned_)
      if (!courses_[dwell.catheter]) given.push_back(as_seed(dwell, plan_.source, plan_.source_strength_u));
    add("missing", kMissingMm * static_cast<double>(given.size()),
        fmt::format("{} {} missing: {}", counted(without.size(), "catheter"),
                    without.size() == 1 ? "is" : "are", names(without)),
        {}, given, without);
  }

  const HdrPlan& plan_;
  const std::vector<const CatheterCourse*>& courses_;
  ImplantDose delivered_;
  std::vector<Dwell> planned_;
  Deviations deviations_;
  std::vector<DoseSeed> at_rest_;
  std::vector<StructureDose> as_is_;
  std::vector<Finding> found_;
};

}  // namespace

std::vector<Finding> find_hdr_mistakes(const HdrPlan& plan, const TemplateGrid& grid,
                                       const std::vector<const CatheterCourse*>& courses,
                                       const std::vector<std::uint32_t>& unplanned,
                                       const std::vector<Structure>& structures, const DoseSettings& dose) {
  return HdrMistakes(plan, grid, courses, structures, dose).find(unplanned);
}

}  // namespace brachy
