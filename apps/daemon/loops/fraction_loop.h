#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "apps/daemon/loops/tick_field.h"
#include "core/brachytherapy/hdr/catheter_course.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/realtime/deadline.h"
#include "core/realtime/hand_over.h"
#include "core/scene/scene.h"
#include "net/wire/messages.h"

namespace brachy {

/// Inputs and output of the fraction loop, for its thread only.
struct FractionPorts {
  HandOver<ImagedTick>::Reader& ticks;
  HandOver<RunModel>::Reader& models;
  std::function<void(net::DoseMessage)> deliver;
  std::function<void(const std::vector<CatheterCourse>&)> keep;  ///< how the catheters lie
};

/// The dose of a fraction that were given now: the plan's times in the catheters that are in the tissue, as score_hdr
/// has them, at the material points of their dwells; of the structures, at the points `surface` (at rest, mm), and
/// together with the planned catheters that are not in yet. Delivered at the start and whenever a dwell has moved by
/// more than 0.05 mm, four times a second at most, until `stop`; `keep` gets the courses of every tick
/// that is looked at, of which the last one is the last.
/// Threads: the dose thread's whole life, in the place of run_dose_loop; it delays no other thread.
void run_fraction_loop(const std::stop_token& stop, Clock& clock, const Scene& scene, const HdrPlan& plan,
                       const std::vector<Structure>& structures, const std::vector<Vec3>& surface,
                       const FractionPorts& ports);

}  // namespace brachy
