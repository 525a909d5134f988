#include "apps/daemon/loops/dose_loop.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/brachytherapy/seeds/remaining_seeds.h"
#include "core/simulation/new_failed_drops.h"

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

/// The dose that the implant will have if the rest goes by the plan.
class ProjectedDose {
 public:
  ProjectedDose(const ImplantDose& like, const PlanToCome& plan)
      : dose_(like), plan_(plan), lost_(plan.lost) {}

  /// Takes what has failed in this run until now.
  void add_lost(const FailedDrops& failed) {
    visit_new(failed, seen_, [&](const FailedDrop& drop) {
      if (drop.why == DropRefusal::kLost && drop.planned >= 0) lost_.push_back(drop.planned);
    });
  }
  void restart() {
    seen_ = 0;
    lost_.clear();
  }
  /// nullopt: `stop` came meanwhile.
  std::optional<std::vector<StructureDose>> evaluate(std::span<const Seed> fallen,
                                                     const std::stop_token& stop) {
    const LoadingPlan& plan = plan_.plan.value();
    if (plan.seeds.empty()) return std::vector<StructureDose>();
    dose_.clear();
    for (const Seed& seed : fallen)
      if (!add(seed.at_rest(), stop)) return std::nullopt;
    for (const PlannedSeed& seed : remaining_seeds(plan.seeds, fallen, lost_))
      if (plan.is_in_use(seed.needle) && !add(seed, stop)) return std::nullopt;
    return dose_.evaluate();
  }

 private:
  /// A seed takes more than 1 ms, and a plan may have thousands, for which the daemon's end does not wait.
  bool add(const DoseSeed& seed, const std::stop_token& stop) {
    if (stop.stop_requested()) return false;
    dose_.add(seed);
    return true;
  }

  ImplantDose dose_;
  const PlanToCome& plan_;
  std::vector<std::int32_t> lost_;
  std::uint64_t seen_ = 0;
};

}  // namespace

DoseStatistics run_dose_loop(const std::stop_token& stop, Clock& clock, std::vector<Structure> structures,
                             const DoseSettings& settings, std::vector<Vec3> surface, const PlanToCome& plan,
                             HandOver<DroppedSeeds>::Reader& fallen,
                             const std::function<void(net::DoseMessage)>& deliver) {
  ImplantDose dose(std::move(structures), settings);
  ProjectedDose projected(dose, plan);
  DoseStatistics statistics;
  DeadlineTimer timer(kPeriodNs, clock.now_ns() + kPeriodNs, clock);
  std::uint64_t run = fallen.value().run, failed = 0;
  for (; !stop.stop_requested(); timer.wait()) {
    fallen.update();
    const DroppedSeeds& all = fallen.value();
    const bool is_other_run = std::exchange(run, all.run) != all.run;
    const bool is_restarted = is_other_run && all.count < dose.seed_count();
    if (is_restarted) {
      dose.clear();
      projected.restart();
    }
    const bool is_other_plan = plan.plan.update();
    const bool has_failed = std::exchange(failed, all.failed.count) != all.failed.count;
    projected.add_lost(all.failed);
    const bool is_other_rest = is_other_plan || (has_failed && !plan.plan.value().seeds.empty());
    if (all.count == dose.seed_count() && !is_restarted && !is_other_rest) continue;
    const bool is_new = all.count != dose.seed_count();
    for (const Seed& seed : all.seeds().subspan(dose.seed_count())) {
      if (stop.stop_requested()) return statistics;
      dose.add(seed.at_rest());
    }
    net::DoseMessage message = message_of(all.seeds(), dose, surface);
    if (is_new && all.publish_ns) statistics.drop_to_dvh_ns.record(clock.now_ns() - all.publish_ns);
    auto with_planned = projected.evaluate(all.seeds(), stop);
    if (!with_planned) break;
    message.with_planned = std::move(*with_planned);
    deliver(std::move(message));
  }
  return statistics;
}

}  // namespace brachy
