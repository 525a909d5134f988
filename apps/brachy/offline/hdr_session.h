#pragma once

#include <string>

#include "core/brachytherapy/hdr/hdr_plan.h"

namespace brachy {

/// A trajectory file of a plan's catheters, in its order, catheter n as needle n: each starts 5 mm outside its hole, or
/// its course's end, goes straight, or along its course, to its planned tip, rests for 0.5 s and stays; then the next.
/// At the end all rest for 1 s.
std::string hdr_session_csv(const HdrPlan& plan, const TemplateGrid& grid, double speed_mm_s);

}  // namespace brachy
