#include "apps/doctor/fitting.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/choice/choice.h"
#include "core/scene/load_body.h"

namespace brachy {
namespace {

constexpr std::array kUsualRatesHz = {1000., 500., 400., 250., 200., 150., 100.,
                                      80.,   60.,  50.,  40.,  30.,  20.,  10.};
constexpr double kCheaper = 2.0 / 3;  // than the scene's own model, else not worth a trial
constexpr std::size_t kMostModels = 3;

std::vector<Candidate> charted(const Scene& scene, const ElasticBody& body,
                               const std::vector<ChartedRow>& rows) {
  return candidates(nearest_scenes(body, rows), rows, scene.model.needs == "surface");
}

/// The row of the scene's model: of a ψ kernel, the one with the nearest support. Null: it is not charted.
const Candidate* row_of(const ModelSettings& model, const std::vector<Candidate>& all) {
  const Candidate* nearest = nullptr;
  const auto distance = [&](const Candidate& c) {
    return c.settings.support_mm > 0 ? std::abs(std::log(c.settings.support_mm / model.support_radius_mm))
                                     : 0;
  };
  for (const Candidate& c : all)
    if (c.settings.kernel == model.kernel && (!nearest || distance(c) < distance(*nearest))) nearest = &c;
  return nearest;
}

double missed_share(std::uint64_t missed, std::uint64_t ticks) {
  return missed + ticks == 0 ? 1 : static_cast<double>(missed) / static_cast<double>(missed + ticks);
}

class Search {
 public:
  Search(const Scene& scene, const std::function<TrialResult(const Scene&)>& run_trial)
      : scene_(scene), body_(load_body(scene)), run_trial_(run_trial) {}

  /// True if it fits, and is then recommended.
  bool attempt(const std::string& kernel, double support_radius_mm, double hz) {
    Scene tried = scene_;
    tried.model.kernel = kernel;
    tried.model.support_radius_mm = support_radius_mm;
    tried.rates.deformation_hz = hz;
    found.tried.push_back({kernel, is_matrix_model(kernel) ? 0 : support_radius_mm, hz,
                           charted_error_mm(tried, body_, stored_comparison()), run_trial_(tried)});
    if (is_busy(found.tried.back().result) || !fits(found.tried.back())) return false;
    found.fit = found.tried.size() - 1;
    return true;
  }

  /// The scene's own model, ever slower, from what the last try of it took; not below `least_hz`.
  bool slow_down(double least_hz) {
    while (const auto hz = lower_rate(own_)) {
      if (*hz < least_hz) return false;
      if (attempt(scene_.model.kernel, scene_.model.support_radius_mm, *hz)) return true;
      own_ = found.tried.back();
    }
    return false;
  }

  bool try_own() {
    const bool is_fit =
        attempt(scene_.model.kernel, scene_.model.support_radius_mm, scene_.rates.deformation_hz);
    own_ = found.tried.back();
    return is_fit;
  }

  bool try_cheaper() {
    for (const ChartedModel& model : cheaper_models(scene_, body_, stored_comparison())) {
      const double support =
          model.support_radius_mm > 0 ? model.support_radius_mm : scene_.model.support_radius_mm;
      if (attempt(model.kernel, support, scene_.rates.deformation_hz)) return true;
    }
    return false;
  }

  Diagnosis found;

 private:
  const Scene& scene_;
  const ElasticBody body_;
  const std::function<TrialResult(const Scene&)>& run_trial_;
  Trial own_;  // the last of the scene's own model
};

}  // namespace

bool fits(const Trial& trial) {
  const TrialResult& r = trial.result;
  // The first tick after the other threads were woken may be late on any machine: one extra miss is tolerated.
  const double allowed = missed_share(r.control_missed, r.control_ticks) + kMostMissedShare +
                         1.0 / static_cast<double>(std::max<std::uint64_t>(r.ticks + r.missed, 1));
  return r.ticks > 0 && r.tick_p99_ms <= kMostOfBudget * trial.budget_ms() &&
         missed_share(r.missed, r.ticks) <= allowed;
}

bool is_busy(const TrialResult& r) {
  return r.control_ticks + r.control_missed > 0 &&
         missed_share(r.control_missed, r.control_ticks) > kMostIdleMissedShare;
}

std::vector<ChartedModel> cheaper_models(const Scene& scene, const ElasticBody& body,
                                         const std::vector<ChartedRow>& rows) {
  std::vector<Candidate> all = charted(scene, body, rows);
  const Candidate* own = row_of(scene.model, all);
  double most_ms = own ? kCheaper * own->tick_ms : std::numeric_limits<double>::max();
  std::erase_if(all, [](const Candidate& c) { return c.settings.min_det <= 0; });
  std::ranges::stable_sort(all, {}, &Candidate::error_mm);
  std::vector<ChartedModel> models;
  for (const Candidate& c : all) {
    if (c.tick_ms >= most_ms || models.size() == kMostModels) continue;
    most_ms = c.tick_ms;
    models.push_back({c.settings.kernel, c.settings.support_mm, c.error_mm, c.tick_ms});
  }
  return models;
}

std::optional<double> charted_error_mm(const Scene& scene, const ElasticBody& body,
                                       const std::vector<ChartedRow>& rows) {
  const std::vector<Candidate> all = charted(scene, body, rows);
  const Candidate* own = row_of(scene.model, all);
  return own ? std::optional(own->error_mm) : std::nullopt;
}

std::optional<double> lower_rate(const Trial& trial) {
  for (const double hz : kUsualRatesHz)
    if (hz < trial.deformation_hz && trial.result.tick_p99_ms <= kMostOfBudget * 1000 / hz) return hz;
  return std::nullopt;
}

Diagnosis diagnose(const Scene& scene, const std::function<TrialResult(const Scene&)>& run_trial) {
  Search search(scene, run_trial);
  const double half = 0.5 * scene.rates.deformation_hz;
  if (search.try_own() || is_busy(search.found.tried.front().result)) return std::move(search.found);
  search.slow_down(half) || search.try_cheaper() || search.slow_down(0);
  return std::move(search.found);
}

}  // namespace brachy
