#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/plan/optimiser/needle_load.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// How far needles keep from what they must not hit, mm, between the needle's axis and the surface.
struct NeedleClearances {
  double urethra_mm =
      3;  ///< within the gland; 5 mm where the template allows is customary, dose keeps the rest
  double rectum_mm = 3;      ///< from the template to the tip
  double pubic_arch_mm = 2;  ///< from the template to the tip; a structure "pubic_arch"
  /// A tip may be so far past the gland's far end, and a seed's centre so far before its near one: without it a small
  /// gland, of few seeds a needle, stays cold at its ends.
  double beyond_ends_mm = 1.5;
  bool operator==(const NeedleClearances&) const = default;
};

/// A hole that a needle may go through, and where its seeds may lie.
struct NeedleChoice {
  std::string hole;
  Vec3 position;  ///< of the hole, mm, world
  int first_row = 0,
      last_row = 0;       ///< of DoseRows: seeds' centres, within the gland's ends and beyond_ends_mm
  int most_tip_mm = 0;    ///< beyond the template
  int least_tail_mm = 0;  ///< beyond the template: the train ends here or farther

  /// Whether the train lies between the ends; a needle that is not used does.
  bool holds(const NeedleLoad& load) const;
};

/// What stands in the way of holes that lead to the gland.
struct BlockedHoles {
  std::size_t urethra = 0, rectum = 0, pubic_arch = 0, too_short = 0;
};

/// The holes whose needles pass through the gland (find_gland_holes, whose errors these are) clear of everything,
/// column by column. `structures`: gland first. A tip goes to a whole mm, and no farther than the needle's length.
std::vector<NeedleChoice> find_needle_choices(const std::vector<Structure>& structures,
                                              const TemplateGrid& grid, const NeedleClearances& clearances,
                                              double needle_length_mm, BlockedHoles* blocked = nullptr);

}  // namespace brachy
