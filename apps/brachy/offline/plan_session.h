#pragma once

#include "core/brachytherapy/plan/plan.h"
#include "haptics/trajectory/trajectory.h"

namespace brachy {

struct SessionSpeeds {
  double speed_mm_s = 50;       ///< of the tip, in and out and from hole to hole
  double drop_speed_mm_s = 20;  ///< while it is drawn back over its train
};

/// A device that does what a plan says, for seeds.applicator = "train": needle by needle, in the plan's order, the
/// tip starts 5 mm outside its hole, goes along +z to the planned tip, rests for 0.5 s, presses the button, is after
/// 0.1 s drawn back over the train's length, then out, releases the button, and moves on to the next hole. It does not
/// react to the tissue: the tip goes to its planned position in the world, however the tissue moves. Preconditions: the
/// plan has a needle, and its holes are the grid's (load_plan).
Trajectory session_of(const Plan& plan, const TemplateGrid& grid, const SessionSpeeds& speeds);

}  // namespace brachy
