#include "apps/daemon/loops/fraction_loop.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "apps/score/hdr_score.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/simulation/delivered_catheters.h"

namespace brachy {
namespace {

constexpr std::int64_t kFractionPeriodNs = 250'000'000;
constexpr double kMovedMm = 0.05;
constexpr std::int64_t kRestOfTime =
    3;  // times as long as an update took until the next: a quarter of a processor

/// The farthest dwell behind its catheter's tip, mm.
double deepest_dwell_mm(const HdrPlan& plan) {
  double most = 0;
  for (std::size_t c = 0; c < plan.catheters.size(); ++c)
    for (std::size_t i = 0; i < plan.catheters[c].dwell_s.size(); ++i)
      most = std::max(most, plan.offset_mm(c, i));
  return most;
}

bool has_moved(const std::vector<Dwell>& before, const std::vector<Dwell>& now) {
  return !std::ranges::equal(before, now, [](const Dwell& a, const Dwell& b) {
    return a.catheter == b.catheter && a.index == b.index && (a.position - b.position).norm() <= kMovedMm;
  });
}

/// The dose of dwells, and of the plan's others.
class FractionDose {
 public:
  FractionDose(const Scene& scene, const HdrPlan& plan, const std::vector<Structure>& structures,
               const std::vector<Vec3>& surface)
      : plan_(plan), planned_(plan.dwells(scene.template_grid)), surface_(surface), dose_(structures, [&] {
          DoseSettings settings = scene.dose;
          settings.prescription_gy = plan.prescription_gy;
          return settings;
        }()) {}

  /// nullopt: `stop` came meanwhile.
  std::optional<net::DoseMessage> of(const std::vector<Dwell>& delivered, const std::stop_token& stop) {
    std::set<std::size_t> catheters;
    net::DosedFraction fraction{0, static_cast<std::uint32_t>(plan_.catheters.size()), 0, 0};
    for (const Dwell& dwell : delivered) {
      catheters.insert(dwell.catheter);
      fraction.dwells += dwell.seconds > 0;
      fraction.seconds += dwell.seconds;
    }
    fraction.catheters = static_cast<std::uint32_t>(catheters.size());
    net::DoseMessage message;
    message.prescription_gy = plan_.prescription_gy;
    message.air_kerma_strength_u = plan_.source_strength_u;
    message.fraction = fraction;
    dose_.clear();
    if (!add(delivered, stop)) return std::nullopt;
    message.structures = dose_.evaluate();
    for (const Vec3& p : surface_) message.surface_gy.push_back(static_cast<float>(dose_.grid().at(p)));
    std::vector<Dwell> missing;
    std::ranges::copy_if(planned_, std::back_inserter(missing),
                         [&](const Dwell& dwell) { return !catheters.contains(dwell.catheter); });
    if (!add(missing, stop)) return std::nullopt;
    message.with_planned = dose_.evaluate();
    return message;
  }

 private:
  /// A dwell takes more than 1 ms, for which the daemon's end does not wait.
  bool add(const std::vector<Dwell>& dwells, const std::stop_token& stop) {
    for (const DoseSeed& seed : as_seeds(dwells, plan_.source, plan_.source_strength_u)) {
      if (stop.stop_requested()) return false;
      dose_.add(seed);
    }
    return true;
  }

  const HdrPlan& plan_;
  const std::vector<Dwell> planned_;
  const std::vector<Vec3>& surface_;
  ImplantDose dose_;
};

}  // namespace

void run_fraction_loop(const std::stop_token& stop, Clock& clock, const Scene& scene, const HdrPlan& plan,
                       const std::vector<Structure>& structures, const std::vector<Vec3>& surface,
                       const FractionPorts& ports) {
  const double deepest_mm = deepest_dwell_mm(plan);
  FractionDose dose(scene, plan, structures, surface);
  TickField field;
  std::optional<std::vector<Dwell>> last;  // that were delivered; none: nothing was
  std::int64_t next_ns = 0;
  // Of the newest tick that has come since the last call; none: there was none that its model is known for.
  const auto courses_now = [&]() -> std::optional<std::vector<CatheterCourse>> {
    ports.models.update();
    if (!ports.ticks.update()) return std::nullopt;
    const ImagedTick& tick = ports.ticks.value();
    if (!field.take(tick, ports.models.value())) return std::nullopt;
    auto courses = catheter_courses(field.model(), field.field(), field.verdict(), tick.frame,
                                    tick.instruments, plan, deepest_mm);
    ports.keep(courses);
    return courses;
  };
  DeadlineTimer timer(kFractionPeriodNs, clock.now_ns() + kFractionPeriodNs, clock);
  for (; !stop.stop_requested(); timer.wait()) {
    const std::int64_t start_ns = clock.now_ns();
    if (start_ns < next_ns) continue;
    const auto courses = courses_now();
    if (!courses) continue;
    std::vector<Dwell> dwells = delivered_dwells(plan, assign_catheters(plan, scene.template_grid, *courses));
    if (last && !has_moved(*last, dwells)) continue;
    auto message = dose.of(dwells, stop);
    if (!message) break;
    last = std::move(dwells);
    ports.deliver(std::move(*message));
    next_ns = clock.now_ns() + kRestOfTime * (clock.now_ns() - start_ns);
  }
  courses_now();
}

}  // namespace brachy
