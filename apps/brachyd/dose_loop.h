#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "apps/brachyd/fallen_seeds.h"
#include "core/dose/implant_dose.h"
#include "core/realtime/histogram.h"
#include "core/realtime/triple_buffer.h"
#include "net/wire/messages.h"

namespace brachy {

/// What the dose thread did.
struct DoseStatistics {
  Histogram drop_to_dvh_ns;  ///< from the tick that published a seed to the DVH with it in
};

/// Adds every seed that has fallen to the dose of those before it, at its material point (where it gives its dose for months),
/// and tells the new dose of the structures and at the points `surface` (at rest, mm); until `stop`. Looks for seeds every
/// 5 ms. `deliver` is called for each time that seeds were found, or a simulation that began anew has none. Seeds that are
/// there at the start count, but not in the statistics.
/// Threads: the dose thread's whole life; it never holds another up.
DoseStatistics run_dose_loop(const std::stop_token& stop, std::vector<Structure> structures,
                             const DoseSettings& settings, std::vector<Vec3> surface,
                             TripleBuffer<FallenSeeds>::Reader& fallen,
                             const std::function<void(net::DoseMessage)>& deliver);

}  // namespace brachy
