#pragma once

#include <span>
#include <vector>

#include "core/brachytherapy/hdr/catheter_course.h"
#include "core/simulation/simulator.h"

namespace brachy {

/// The courses of the needles that are in the tissue after the simulator's last step, whose state this is: straight
/// along the pose, or, of a needle that bends, through its shape (Catmull and Rom's spline through
/// NeedleShape::points), from the tip to the template's plane. A point's place at rest is its material point; where
/// there is none in the tissue, the point itself. So dwell positions ride with needles and tissue. Not real-time.
/// Threads: the simulator's.
///
/// Needle n follows the course of catheter n, where the plan has one and the tip is within 15 mm of it (follow_course),
/// as its contact does. `plan`: null where there is none.
std::vector<CatheterCourse> delivered_catheters(Simulator& simulator, const MeshState& state,
                                                const HdrPlan* plan);
/// The same, quickly: of needles in a field that is another's, to some 0.001 mm (find_material_points); the probe
/// behind them is none. Points farther than `rest_mm` behind the tip have no place at rest, but where they are now.
/// Threads: the field's.
std::vector<CatheterCourse> catheter_courses(const SimulationModel& model, DisplacementField& field,
                                             Verdict verdict, const BodyFrame& frame,
                                             std::span<const NeedleState> needles, const HdrPlan& plan,
                                             double rest_mm);

/// The point of a needle of `length_mm` at arc length `s_mm` behind its tip.
Vec3 point_behind_tip(const NeedleState& needle, double length_mm, double s_mm);

}  // namespace brachy
