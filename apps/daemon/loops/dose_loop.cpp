#include "apps/daemon/loops/dose_loop.h"

#include <utility>

#include "core/realtime/deadline.h"

namespace brachy {
namespace {

constexpr std::int64_t kPeriodNs = 5'000'000;

net::DoseMessage message_of(std::span<const Seed> seeds, const ImplantDose& dose,
                            const std::vector<Vec3>& surface) {
  net::DoseMessage message;
  message.seeds = static_cast<std::uint32_t>(seeds.size());
  message.prescription_gy = dose.settings().prescription_gy;
  for (const Seed& seed : seeds) message.air_kerma_strength_u += seed.air_kerma_strength_u;
  message.structures = dose.evaluate();
  for (const Vec3& p : surface) message.surface_gy.push_back(static_cast<float>(dose.grid().at(p)));
  return message;
}

}  // namespace

DoseStatistics run_dose_loop(const std::stop_token& stop, std::vector<Structure> structures,
                             const DoseSettings& settings, std::vector<Vec3> surface,
                             HandOver<DroppedSeeds>::Reader& fallen,
                             const std::function<void(net::DoseMessage)>& deliver) {
  ImplantDose dose(std::move(structures), settings);
  DoseStatistics statistics;
  DeadlineTimer timer(kPeriodNs, monotonic_ns() + kPeriodNs);
  std::uint64_t run = fallen.value().run;
  for (; !stop.stop_requested(); timer.wait()) {
    fallen.update();
    const DroppedSeeds& all = fallen.value();
    const bool is_restarted = std::exchange(run, all.run) != all.run && all.count < dose.seed_count();
    if (is_restarted) dose.clear();
    if (all.count == dose.seed_count() && !is_restarted) continue;
    for (const Seed& seed : all.seeds().subspan(dose.seed_count())) dose.add(seed.at_rest());
    deliver(message_of(all.seeds(), dose, surface));
    if (all.publish_ns) statistics.drop_to_dvh_ns.record(monotonic_ns() - all.publish_ns);
  }
  return statistics;
}

}  // namespace brachy
