#include "apps/brachyd/dose_loop.h"

#include "core/realtime/deadline.h"

namespace brachy {
namespace {

constexpr std::int64_t kPeriodNs = 5'000'000;

}  // namespace

DoseStatistics run_dose_loop(
    const std::stop_token& stop, std::vector<Structure> structures, const DoseSettings& settings,
    TripleBuffer<FallenSeeds>::Reader& fallen,
    const std::function<void(std::span<const Seed>, std::vector<StructureDose>)>& deliver) {
  ImplantDose dose(std::move(structures), settings);
  DoseStatistics statistics;
  DeadlineTimer timer(kPeriodNs, monotonic_ns() + kPeriodNs);
  for (; !stop.stop_requested(); timer.wait()) {
    fallen.update();
    const FallenSeeds& all = fallen.value();
    if (all.count == dose.seed_count()) continue;
    for (const Seed& seed : all.seeds().subspan(dose.seed_count())) dose.add(seed.at_rest());
    deliver(all.seeds(), dose.evaluate());
    if (all.publish_ns) statistics.drop_to_dvh_ns.record(monotonic_ns() - all.publish_ns);
  }
  return statistics;
}

}  // namespace brachy
