#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "apps/daemon/loops/dropped_seeds.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/seeds/loading_plan.h"
#include "core/realtime/deadline.h"
#include "core/realtime/hand_over.h"
#include "core/realtime/histogram.h"
#include "net/wire/messages.h"

namespace brachy {

/// Statistics of the dose thread.
struct DoseStatistics {
  Histogram drop_to_dvh_ns;  ///< from the tick that published a seed to the DVH that includes it
};

/// What is still to be delivered.
struct PlanToCome {
  HandOver<LoadingPlan>::Reader& plan;  ///< in use; without needles: there is no plan
  std::vector<std::int32_t> lost;       ///< of its seeds, by an earlier run
};

/// Adds every dropped seed to the dose of those before it, at its material point (where it gives its dose for
/// months), and delivers the new dose of the structures and at the points `surface` (at rest, mm), until `stop`;
/// with a plan also that of the seeds dropped so far together with those that are still in their needles, where the
/// plan has them (core/brachytherapy/seeds/remaining_seeds.h). Polls for seeds every 5 ms. Calls `deliver` once for
/// each poll that found seeds, or a restarted simulation without any; with a plan also where a seed failed or the
/// plan was changed. Seeds present at the start count, but not in the statistics.
/// Threads: the dose thread's whole life; it delays no other thread.
DoseStatistics run_dose_loop(const std::stop_token& stop, Clock& clock, std::vector<Structure> structures,
                             const DoseSettings& settings, std::vector<Vec3> surface, const PlanToCome& plan,
                             HandOver<DroppedSeeds>::Reader& fallen,
                             const std::function<void(net::DoseMessage)>& deliver);

}  // namespace brachy
