#include "apps/daemon/loops/ultrasound_loop.h"

#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/scene/load_ultrasound.h"

namespace brachy {
namespace {

/// The loop's state between periods.
class UltrasoundRounds {
 public:
  UltrasoundRounds(Clock& clock, UltrasoundScanner& scanner, const UltrasoundPorts& ports,
                   const SurfaceMesh& gland)
      : clock_(clock), scanner_(scanner), ports_(ports), gland_(gland) {}

  /// One period: images of the newest tick, where there is a newer one or something else is to be shown.
  void round(const ScannerSettings& settings, double period_s, std::uint64_t overruns) {
    const bool was_frozen = is_frozen_, is_other_demand = !(settings.demand == demand_);
    const bool is_changed = settings.version != version_;
    is_frozen_ = settings.is_frozen && has_published_;  // what is frozen is an image
    demand_ = settings.demand;
    version_ = settings.version;
    if (is_frozen_)
      scanner_.set_demand(demand_);  // a frozen image stays as it is
    else
      scanner_.set(settings);
    scanner_.move(period_s);
    ports_.models.update();
    const bool is_fresh = ports_.ticks.update();
    statistics_.overruns = overruns;
    bool is_published = false;
    if (is_frozen_) {
      if (was_frozen && !is_other_demand) return;
      if (!was_frozen)
        if (auto gland = scanner_.deformed(gland_.vertices)) ports_.on_freeze(std::move(gland));
      for (std::size_t v = 0; v < scanner_.views(); ++v)
        if (scanner_.repeat(ports_.ticks.value(), v, ports_.images[v]->slot())) {
          ports_.images[v]->publish();
          is_published = true;
        }
    } else if (is_fresh || is_changed || was_frozen || is_other_demand) {
      is_published = scan();
    }
    if (is_published) ports_.on_images();
    has_published_ |= is_published;
    ports_.statistics.slot() = statistics_;
    ports_.statistics.publish();
  }

 private:
  bool scan() {
    const std::int64_t start_ns = clock_.now_ns();
    bool is_published = false;
    scanner_.take(ports_.ticks.value(), ports_.models.value());
    std::int64_t before_ns = clock_.now_ns();
    statistics_.field_ns.record(before_ns - start_ns);
    for (std::size_t v = 0; v < scanner_.views(); ++v) {
      const bool has_image = scanner_.scan(ports_.ticks.value(), v, ports_.images[v]->slot());
      const std::int64_t after_ns = clock_.now_ns();
      if (scanner_.result() == ImageResult::kNew) {
        ++statistics_.images;
        statistics_.image_ns.record(after_ns - before_ns);
      } else {
        ++statistics_.held;
      }
      before_ns = after_ns;
      if (!has_image) continue;
      ports_.images[v]->publish();
      is_published = true;
    }
    return is_published;
  }

  Clock& clock_;
  UltrasoundScanner& scanner_;
  const UltrasoundPorts& ports_;
  const SurfaceMesh& gland_;  // at rest
  UltrasoundStatistics statistics_;
  bool is_frozen_ = false, has_published_ = false;
  net::ImageDemand demand_;
  std::uint64_t version_ = ~std::uint64_t{0};
};

}  // namespace

void run_ultrasound_loop(const std::stop_token& stop, Clock& clock, const Scene& scene,
                         const std::vector<Structure>& structures, std::shared_ptr<const EchoMap> echoes,
                         const RigidTransform& X_WR, const UltrasoundPorts& ports) {
  const double period_s = 1 / scene.ultrasound.rate_hz;
  const std::int64_t period_ns = std::llround(1e9 * period_s);
  DeadlineTimer timer(period_ns, clock.now_ns() + period_ns, clock);
  std::unique_ptr<UltrasoundScanner> scanner;
  std::optional<UltrasoundRounds> rounds;
  for (; !stop.stop_requested(); timer.wait()) {
    ports.settings.update();
    const ScannerSettings& settings = ports.settings.value();
    if (!settings.demand.any) continue;
    try {
      if (!scanner) {
        if (!echoes) echoes = load_echo_map(scene, structures);
        scanner = std::make_unique<UltrasoundScanner>(scene, echoes, X_WR);
        scanner->set(settings);
        rounds.emplace(clock, *scanner, ports, structures.front().mesh);
      }
      rounds->round(settings, period_s, timer.overruns());
    } catch (const UserError& e) {
      return ports.on_failure(e.what());
    }
  }
}

}  // namespace brachy
