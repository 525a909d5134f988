#include "core/brachytherapy/plan/plan_check.h"

#include <algorithm>

#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/base/utf8.h"

namespace brachy {

void check_needle(const Plan& plan, std::size_t n, const PlanLimits& limits, const RefuseKey& refuse) {
  const PlanNeedle& needle = plan.needles[n];
  if (!limits.grid.position(needle.hole))
    refuse("hole", "is \"" + one_short_line(needle.hole) + "\"; " + limits.grid.lacks(needle.hole));
  for (std::size_t before = 0; before < n; ++before)
    if (plan.needles[before].hole == needle.hole)
      refuse("hole", "is \"" + needle.hole + "\" for the second time (needles " + std::to_string(before + 1) +
                         " and " + std::to_string(n + 1) + "); use each hole once");
  if (needle.train.find_first_not_of("s-") != std::string::npos)
    refuse("train", "is \"" + one_short_line(needle.train) +
                        "\"; it is s for a seed and - for a spacer, from the tip backwards");
  if (needle.train.find('s') == std::string::npos)
    refuse("train", "has no seed; add an s or remove the needle");
  const double depth = plan.base_plane_mm - needle.retraction_mm;
  if (needle.train_length_mm() > depth)
    refuse("train", "is " + text_of(needle.train_length_mm()) + " mm long and the tip stops " +
                        text_of(depth) + " mm beyond the template; shorten it or lower retraction_mm");
  if (depth > limits.needle_length_mm)
    refuse("hole", "has its tip " + text_of(depth) + " mm beyond the template and the needle is " +
                       text_of(limits.needle_length_mm) + " mm long; lower base_plane_mm");
}

void check_name(const std::string& name, const RefuseKey& refuse) {
  if (!is_printable(name))
    refuse("name", "has a line end, a control character or invalid UTF-8; write it as one line of text");
  if (name.size() > PlanLimits::kLongestName)
    refuse("name", "is longer than " + std::to_string(PlanLimits::kLongestName) + " bytes; shorten it");
}

}  // namespace brachy
