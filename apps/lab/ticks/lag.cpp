#include "apps/lab/ticks/lag.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <stdexcept>

#include "core/models/step_flag.h"
#include "core/realtime/deadline.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"

namespace brachy {
namespace {

constexpr double kPitchMm = 8, kStartMm = -45, kPlaceMm = 10;
constexpr double kInsertMmPerS = 50, kStirMm = 5, kStirHz = 6;
constexpr double kPlacedS = 1, kRestS = 0.3, kInsertS = 1.2, kStirS = 2;

Scene scene_of(const LagScenario& scenario) {
  Scene scene;
  scene.needle.count = scenario.resting + scenario.moving;
  scene.rates.deformation_hz = scenario.rate_hz;
  if (scenario.points > 0) scene.tissue.points = scenario.points;
  return scene;
}

/// The hands of a scenario, tick by tick: needles are put in place, rest, and then some move.
class Hands {
 public:
  explicit Hands(const LagScenario& scenario)
      : scenario_(scenario),
        count_(scenario.resting + scenario.moving),
        side_(static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count_))))) {}

  std::size_t count() const { return count_; }
  std::uint64_t first_moving() const { return ticks_in(kPlacedS + kRestS); }
  std::uint64_t end() const { return first_moving() + ticks_in(scenario_.is_inserted ? kInsertS : kStirS); }
  Vec3 tip(std::size_t needle, std::uint64_t tick) const {
    const double middle = 0.5 * static_cast<double>(side_ - 1);
    const Vec3 hole(kPitchMm * (static_cast<double>(needle % side_) - middle),
                    kPitchMm * (static_cast<double>(needle / side_) - middle), 0);
    const double t_s = static_cast<double>(tick) / scenario_.rate_hz;
    const double moved_s = std::max(0.0, t_s - kPlacedS - kRestS);
    if (needle >= scenario_.resting && scenario_.is_inserted)
      return hole + (kStartMm + kInsertMmPerS * moved_s) * Vec3::UnitZ();
    const double placed = std::min(1.0, t_s / kPlacedS);
    Vec3 tip = hole + (kStartMm + placed * (kPlaceMm - kStartMm)) * Vec3::UnitZ();
    if (needle >= scenario_.resting) tip.x() += kStirMm * std::sin(2 * std::numbers::pi * kStirHz * moved_s);
    return tip;
  }

 private:
  std::uint64_t ticks_in(double s) const {
    return static_cast<std::uint64_t>(std::lround(s * scenario_.rate_hz));
  }

  LagScenario scenario_;
  std::size_t count_, side_;
};

double farthest(std::span<const float> a, std::span<const float> b) {
  double farthest2 = 0;
  for (std::size_t i = 0; i + 2 < a.size(); i += 3) {
    const Eigen::Vector3f apart(a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]);
    farthest2 = std::max(farthest2, static_cast<double>(apart.squaredNorm()));
  }
  return std::sqrt(farthest2);
}

double quantile(std::vector<double> values, double share) {
  const auto at =
      std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())));
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(at));
  return values[at];
}

}  // namespace

std::vector<LagScenario> lag_scenarios() {
  return {{.name = "1_inserted", .is_inserted = true},
          {.name = "1_stirred"},
          {.name = "2_stirred", .moving = 2},
          {.name = "3_stirred", .moving = 3},
          {.name = "4_stirred", .moving = 4},
          {.name = "16_stirred", .moving = 16},
          {.name = "16_and_1_inserted", .resting = 16, .is_inserted = true},
          {.name = "16_and_1_stirred", .resting = 16},
          {.name = "1_inserted_1khz", .is_inserted = true, .rate_hz = 1000},
          {.name = "1_inserted_100k", .is_inserted = true, .points = 100'000}};
}

LagRow measure_lag(const LagScenario& scenario) {
  const Scene scene = scene_of(scenario);
  const auto model = load_simulation_model(scene, load_tissue(scene).tissue);
  auto whole_model = std::make_shared<SimulationModel>(*model);
  whole_model->settings.work.is_whole = true;
  Simulator simulator(model), whole(whole_model);
  MeshState state = simulator.initial_state(), whole_state = whole.initial_state();
  const Hands hands(scenario);
  std::vector<NeedlePose> poses(hands.count());
  LagRow row{.scenario = scenario};
  std::vector<double> lags, times;
  for (std::uint64_t tick = 0; tick < hands.end(); ++tick) {
    for (std::size_t n = 0; n < poses.size(); ++n) {
      poses[n].present = true;
      poses[n].X_WN.p = hands.tip(n, tick);
      ++poses[n].sequence;
    }
    const std::int64_t start = thread_cpu_ns();
    simulator.step(poses, state);
    const double time_ms = 1e-6 * static_cast<double>(thread_cpu_ns() - start);
    whole.step(poses, whole_state);
    if (tick < hands.first_moving()) continue;
    const TickSummary& summary = state.summary;
    const bool is_late = (summary.step_flags & kStepLate) != 0;
    ++row.ticks;
    row.late += is_late;
    row.clamped += (summary.step_flags & kStepClamped) != 0;
    row.unknown += summary.certificate.verdict == Verdict::kUnknown;
    row.landmarks = summary.landmark_count;
    row.told_mm = std::max(row.told_mm, summary.lag_mm);
    times.push_back(time_ms);
    lags.push_back(farthest(state.mesh.deformed_vertices, whole_state.mesh.deformed_vertices));
    row.mean_mm += lags.back();
    const LandmarkSet& set = simulator.landmarks();
    for (std::size_t i = 0; !is_late && i < set.positions.size(); ++i)
      row.missed_mm = std::max(
          row.missed_mm, (simulator.field().displacement_at(set.positions[i]) - set.displacements[i]).norm());
  }
  row.mean_mm /= static_cast<double>(row.ticks);
  row.max_mm = quantile(lags, 1);
  row.p99_mm = quantile(lags, 0.99);
  row.p50_ms = quantile(times, 0.5);
  row.p99_ms = quantile(times, 0.99);
  return row;
}

void write_lag_scenario(const LagScenario& scenario, const std::filesystem::path& folder) {
  const Hands hands(scenario);
  std::string rows = "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,needle\n";
  for (std::uint64_t tick = 0; tick < hands.end(); ++tick)
    for (std::size_t n = 0; n < hands.count(); ++n) {
      const Vec3 p = hands.tip(n, tick);
      rows += fmt::format("{:.4f},1,0,0,{:.6f},0,1,0,{:.6f},0,0,1,{:.6f},{}\n",
                          static_cast<double>(tick) / scenario.rate_hz, p.x(), p.y(), p.z(), n);
    }
  std::string scene =
      fmt::format("[needle]\ncount = {}\n\n[rates]\ndeformation_hz = {}\n", hands.count(), scenario.rate_hz);
  if (scenario.points > 0) scene += fmt::format("\n[tissue]\npoints = {}\n", scenario.points);
  std::filesystem::create_directories(folder);
  for (const auto& [suffix, text] : {std::pair{".csv", &rows}, std::pair{".toml", &scene}}) {
    const std::filesystem::path file = folder / (scenario.name + suffix);
    std::ofstream out(file, std::ios::binary);
    out << *text;
    out.close();
    if (!out) throw std::runtime_error(file.string() + ": cannot be written");
  }
}

std::string to_json(const std::vector<LagRow>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const LagRow& row : rows)
    json.push_back({{"scenario", row.scenario.name},
                    {"landmarks", row.landmarks},
                    {"ticks", row.ticks},
                    {"late", row.late},
                    {"unknown", row.unknown},
                    {"clamped", row.clamped},
                    {"lag_max_mm", row.max_mm},
                    {"lag_p99_mm", row.p99_mm},
                    {"lag_mean_mm", row.mean_mm},
                    {"lag_told_mm", row.told_mm},
                    {"missed_mm", row.missed_mm},
                    {"tick_p50_ms", row.p50_ms},
                    {"tick_p99_ms", row.p99_ms}});
  return json.dump(2) + "\n";
}

std::string to_markdown(const std::vector<LagRow>& rows) {
  std::string text =
      "| needles | landmarks | lag, mm: largest | p99 | mean | told | ticks late | unknown | clamped | "
      "landmarks missed, "
      "mm | tick, ms of a core: p50 | p99 |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const LagRow& row : rows)
    text += fmt::format(
        "| {} | {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {} of {} | {} | {} | {:.4f} | {:.2f} | {:.2f} |\n",
        row.scenario.name, row.landmarks, row.max_mm, row.p99_mm, row.mean_mm, row.told_mm, row.late,
        row.ticks, row.unknown, row.clamped, row.missed_mm, row.p50_ms, row.p99_ms);
  return text;
}

}  // namespace brachy
