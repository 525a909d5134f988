#include "apps/score/cause_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

using Kind = Cause::Kind;

constexpr double kOutOfPlaceMm = 1.5;  // from a hole's middle: between holes

/// Words for a cause's members.
class CauseWords {
 public:
  CauseWords(const Cause& cause, const Explanation& explanation, const Deviations& deviations,
             const Plan& plan, const TemplateGrid& grid)
      : cause_(cause), explanation_(explanation), deviations_(deviations), plan_(plan), grid_(grid) {}

  std::string text() const {
    switch (cause_.kind) {
      case Kind::kAside:
        return cause_.is_of_all
                   ? fmt::format("all needles to one side: the seeds fell {:.1f} mm off on the whole ({})",
                                 across_mm(), across())
                   : fmt::format("{} lie {:.1f} mm aside ({}): {}", needles(), across_mm(), across(),
                                 names());
      case Kind::kTurned:
        return cause_.is_of_all ? fmt::format("the template was turned by {}{}", turn(), and_moved())
                                : fmt::format("{} are turned together by {}{}: {}", needles(), turn(),
                                              and_moved(), names());
      case Kind::kMirrored:
        return cause_.is_of_all
                   ? "left and right were exchanged: the whole implant is mirrored" + mirror_rest()
                   : fmt::format("left and right were exchanged for {}: {}", needles(), names());
      case Kind::kDepth:
        return depth();
      case Kind::kElsewhere:
        return elsewhere();
      case Kind::kExchanged:
        return cause_.needles.size() == 2
                   ? fmt::format("needles {} and {} were swapped: each went through the other's hole",
                                 hole(cause_.needles[0]), hole(cause_.needles[1]))
                   : fmt::format("{} went through each other's holes in a ring: {}", needles(), names());
      case Kind::kSpacing:
        return fmt::format("{} came out {:.0f} % {} than loaded: the needle was drawn back {}",
                           cause_.is_of_all ? std::string("all trains") : "the train of needle " + names(),
                           100 * std::abs(cause_.slope), cause_.slope > 0 ? "longer" : "shorter",
                           cause_.slope > 0 ? "farther than its seeds" : "less than its seeds");
      case Kind::kFront:
        return fmt::format(
            "the foremost seed of {} fell {:.1f} mm too {}{}", members(), std::abs(cause_.shift.z()),
            cause_.shift.z() > 0 ? "deep: it was pushed out ahead of the needle" : "shallow", listed());
      case Kind::kBack:
        return fmt::format(
            "the last seed of {} fell {:.1f} mm too {}{}", members(), std::abs(cause_.shift.z()),
            cause_.shift.z() > 0 ? "deep" : "shallow: it was drawn back with the needle", listed());
      case Kind::kSeeds:
        return seeds();
      case Kind::kScatterAcross:
        return fmt::format(
            "needles scatter: the seeds' errors across them have a standard deviation of {:.1f} mm "
            "each way",
            cause_.shift.z());
      case Kind::kScatterAlong:
        return fmt::format(
            "depths scatter: the seeds' errors along the needle have a standard deviation of {:.1f} mm",
            cause_.shift.z());
      case Kind::kGland:
        return gland();
      case Kind::kSwelling:
        return fmt::format(
            "the gland was swollen when the seeds fell, by {:.0f} % each way: they lie that much "
            "closer together at rest",
            100 * cause_.slope);
      case Kind::kPushed:
        return fmt::format(
            "the gland had been pushed {:.1f} mm {} (by the probe, or a hand) while {} were placed: "
            "their seeds rest that far {}: {}",
            across_mm(), direction(-1), needles(), direction(1), names());
      case Kind::kDragged:
        return fmt::format("after they fell, the seeds of {} moved {:.1f} mm {}, unlike the others': {}",
                           needles(), std::abs(cause_.shift.z()),
                           cause_.shift.z() < 0 ? "back towards the apex, drawn along with the needle"
                                                : "on towards the base",
                           sized_names());
      case Kind::kUnpunctured:
        return fmt::format(
            "{} never went through the capsule: {}; the gland gave way by up to {:.1f} mm, and the "
            "seeds rest {:.1f} mm {} of where they fell on the mean",
            needles(), names(), *std::ranges::max_element(cause_.mm), cause_.shift.norm(),
            cause_.shift.z() < 0 ? "short" : "off");
    }
    return {};
  }

 private:
  const std::string& hole(std::size_t needle) const { return plan_.needles[needle].hole; }
  std::string needles() const { return counted(cause_.needles.size(), "needle"); }
  std::string members() const {
    return cause_.is_of_all ? "every needle" : cause_.needles.size() == 1 ? "needle " + names() : needles();
  }
  std::string names() const {
    std::vector<std::string> all;
    for (const std::size_t n : cause_.needles) all.push_back(hole(n));
    return joined(all);
  }
  std::string listed() const { return cause_.is_of_all || cause_.needles.size() == 1 ? "" : ": " + names(); }
  std::string sized_names() const {
    std::vector<std::string> all;
    for (std::size_t k = 0; k < cause_.needles.size(); ++k)
      all.push_back(fmt::format("{} by {:.1f} mm", hole(cause_.needles[k]), std::abs(cause_.mm[k])));
    return joined(all);
  }

  double across_mm() const { return cause_.shift.head<2>().norm(); }
  std::string across() const {
    return fmt::format("x {:+.1f}, y {:+.1f}", cause_.shift.x(), cause_.shift.y());
  }
  // RAS: +x is the patient's right, +y anterior.
  const char* direction(double sign) const {
    const double x = sign * cause_.shift.x(), y = sign * cause_.shift.y();
    if (std::abs(y) >= std::abs(x)) return y > 0 ? "forwards" : "backwards";
    return x > 0 ? "to the patient's right" : "to the patient's left";
  }
  std::string turn() const {
    const double degrees = cause_.angle * 180 / std::numbers::pi;
    return fmt::format("{:.1f}° {}", std::abs(degrees), degrees > 0 ? "from x to y" : "from y to x");
  }
  std::string and_moved() const {
    return across_mm() > 1 ? fmt::format(", and moved by {:.1f} mm ({})", across_mm(), across()) : "";
  }
  std::string mirror_rest() const {
    const double degrees = cause_.angle * 180 / std::numbers::pi;
    return std::abs(degrees) > 3 ? fmt::format(", and turned by {:.0f}°", degrees) : "";
  }

  std::string depth() const {
    const bool is_deep = cause_.shift.z() > 0;
    if (cause_.is_of_all)
      return fmt::format("all needles too {}: the seeds fell {:.1f} mm {} on the whole",
                         is_deep ? "deep" : "shallow", std::abs(cause_.shift.z()),
                         is_deep ? "beyond the plan" : "short of the plan");
    return fmt::format("{} too {}{}: {}", needles(), is_deep ? "deep" : "shallow",
                       explanation_.depth_of_all_mm != 0 ? " beside the others" : "", sized_names());
  }

  std::size_t seeds_of(std::size_t needle) const {
    return static_cast<std::size_t>(std::ranges::count(deviations_.seeds, needle, &SeedDeviation::needle));
  }

  std::string elsewhere() const {
    const std::size_t n = cause_.needles.front();
    const Vec3 at = deviations_.tips[n] + cause_.shift;
    const auto through = grid_.nearest(at, Vec3::UnitZ());
    const double size = across_mm();
    const std::size_t fell = seeds_of(n);
    const std::string lie = cause_.seeds.size() == fell
                                ? fmt::format("its {} {} {:.1f} mm aside", counted(fell, "seed"),
                                              fell == 1 ? "lies" : "lie", size)
                                : fmt::format("{} of its {} lie {:.1f} mm aside", cause_.seeds.size(),
                                              counted(fell, "seed"), size);
    if (!through || *through == hole(n)) {
      const bool is_beside = !through;
      return fmt::format("needle {} went {}: {} ({})", hole(n), is_beside ? "beside the template" : "aside",
                         lie, across());
    }
    const bool is_in_hole = (*grid_.position(*through) - at).head<2>().norm() <= kOutOfPlaceMm;
    const bool is_others = std::ranges::any_of(plan_.needles, [&](const PlanNeedle& o) {
      const auto place = grid_.position(o.hole);
      return place && (*place - *grid_.position(*through)).norm() < 0.1 * grid_.spacing_mm;
    });
    if (!is_in_hole) return fmt::format("needle {} went between holes: {} ({})", hole(n), lie, across());
    if (is_others)
      return fmt::format("needle {} went through a hole that is another needle's: {} ({})", hole(n), lie,
                         across());
    return fmt::format("needle {} went through {}: {}", hole(n), *through, lie);
  }

  std::string seeds() const {
    const std::size_t n = cause_.needles.front(), fell = seeds_of(n), count = cause_.seeds.size();
    const double along = cause_.shift.z(), size = cause_.shift.norm();
    return fmt::format("needle {}: {} of its {} fell away from where {} planned, {:.1f} mm {}", hole(n),
                       count, counted(fell, "seed"), count == 1 ? "it was" : "they were", size,
                       std::abs(along) < 0.7 * size ? "aside"
                       : along < 0                  ? "short"
                                                    : "too deep");
  }

  std::string gland() const {
    const Vec3& front = cause_.shift;
    if (std::abs(front.z()) < 0.7 * front.norm())
      return fmt::format(
          "the gland lay elsewhere when the seeds fell: the foremost rest {:.1f} mm from there on the "
          "mean (x {:+.1f}, y {:+.1f}, z {:+.1f})",
          front.norm(), front.x(), front.y(), front.z());
    return front.z() < 0
               ? fmt::format(
                     "the needles pushed the gland {:.1f} mm towards the base: so much short their foremost "
                     "seeds rest on the mean, and the base stayed cold",
                     -front.z())
               : fmt::format(
                     "the needles drew the gland {:.1f} mm towards the apex: so much too deep their foremost "
                     "seeds rest on the mean",
                     front.z());
  }

  const Cause& cause_;
  const Explanation& explanation_;
  const Deviations& deviations_;
  const Plan& plan_;
  const TemplateGrid& grid_;
};

}  // namespace

const char* name_of(Cause::Kind kind) {
  switch (kind) {
    case Kind::kAside:
      return "aside";
    case Kind::kTurned:
      return "turned";
    case Kind::kMirrored:
      return "mirrored";
    case Kind::kDepth:
      return "depth";
    case Kind::kElsewhere:
      return "elsewhere";
    case Kind::kExchanged:
      return "swapped";
    case Kind::kSpacing:
      return "spacing";
    case Kind::kFront:
      return "foremost_seeds";
    case Kind::kBack:
      return "last_seeds";
    case Kind::kSeeds:
      return "seeds";
    case Kind::kScatterAcross:
      return "scatter_across";
    case Kind::kScatterAlong:
      return "scatter_along";
    case Kind::kGland:
      return "gland_motion";
    case Kind::kSwelling:
      return "swelling";
    case Kind::kPushed:
      return "gland_pushed";
    case Kind::kDragged:
      return "dragged";
    case Kind::kUnpunctured:
      return "unpunctured";
  }
  return "unknown";
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::string text_of(const Cause& cause, const Explanation& explanation, const Deviations& deviations,
                    const Plan& plan, const TemplateGrid& grid, std::size_t seeds_outside) {
  std::string text = CauseWords(cause, explanation, deviations, plan, grid).text();
  if (seeds_outside > 0)
    text += fmt::format(
        "; {} {} outside the gland",
        seeds_outside == cause.seeds.size()
            ? (seeds_outside == 1 ? std::string("its seed") : fmt::format("all {} seeds", seeds_outside))
            : counted(seeds_outside, "seed"),
        seeds_outside == 1 ? "lies" : "lie");
  return text;
}

}  // namespace brachy
