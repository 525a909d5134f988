// Dose on a grid beside the computation it replaces: a seed against the exact sum's loop over the same points, all
// structures' DVH against sorting their voxels; and over the grid's spacing, the errors of V100, D90 and the dose
// between points.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "apps/bench/benches.h"
#include "apps/bench/turns.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/scene/load_structures.h"
#include "core/scene/scene.h"

namespace brachy::bench {
namespace {

constexpr double kPrescriptionGy = 145, kStrengthU = 0.4;
constexpr std::size_t kSeeds = 100;
constexpr double kHalfCube = 30;  // mm: 61³ points at 1 mm

/// The default scene's structures, 100 seeds in its gland, and the exact dose at random points of it.
struct Implant {
  std::vector<Structure> structures = load_structures(Scene{});
  std::vector<DoseSeed> seeds;
  std::vector<Vec3> points;
  std::vector<double> exact_gy;  // at points

  explicit Implant(std::size_t count) {
    const SurfaceBvh gland(structures.front().mesh);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> one(0, 1);
    const auto inside = [&] {
      for (;;) {
        const double x = one(random), y = one(random), z = one(random);
        Vec3 p = gland.min() + Vec3(x, y, z).cwiseProduct(gland.max() - gland.min());
        if (gland.inside(p)) return p;
      }
    };
    while (seeds.size() < kSeeds) {  // 3 mm or more below the surface, 4 mm or more apart
      const Vec3 p = inside();
      const double tilt_x = 0.2 * one(random) - 0.1, tilt_y = 0.2 * one(random) - 0.1;
      if (gland.closest_point(p).signed_distance > -3 ||
          std::ranges::any_of(seeds, [&](const DoseSeed& s) { return (s.position - p).norm() < 4; }))
        continue;
      seeds.push_back({.position = p,
                       .axis = Vec3(tilt_x, tilt_y, 1).normalized(),
                       .source = SourceModel::kAmersham6711,
                       .air_kerma_strength_u = kStrengthU});
    }
    while (points.size() < count) points.push_back(inside());
    for (const Vec3& p : points) exact_gy.push_back(total_dose_gy(seeds, p));
  }
};

/// Made at the first call; `points` is the same for a whole run.
const Implant& implant(std::size_t points) {
  static const Implant made(points);
  return made;
}

/// Adding a seed to a grid without tables and vectorisation.
void add_exactly(const DoseGrid& grid, const DoseSeed& seed, std::vector<float>& dose) {
  const auto [nx, ny, nz] = grid.size();
  for (std::size_t k = 0; k < nz; ++k)
    for (std::size_t j = 0; j < ny; ++j)
      for (std::size_t i = 0; i < nx; ++i)
        dose[grid.index(i, j, k)] += static_cast<float>(total_dose_gy({&seed, 1}, grid.position(i, j, k)));
}

void run_seed(benchmark::State& state, Report& report, const BenchOptions& options) {
  const Implant& made = implant(options.cases.dose_points);
  DoseGrid grid(Vec3::Constant(-kHalfCube), Vec3::Constant(kHalfCube), 1, options.target);
  std::vector<float> exact(grid.dose_gy().size());
  std::size_t ours = 0, theirs = 0;
  Row row{.name = "dose/seed", .kernel = "6711", .points = exact.size(), .landmarks = 1, .support_mm = 0};
  time_row(state, row, {.run = [&] { grid.add(made.seeds[ours++ % kSeeds]); }},
           {.run = [&] { add_exactly(grid, made.seeds[theirs++ % kSeeds], exact); }});
  grid.clear();
  std::ranges::fill(exact, 0.0f);
  double largest = 0;
  for (const DoseSeed& seed : made.seeds) {
    grid.add(seed);
    add_exactly(grid, seed, exact);
  }
  for (std::size_t i = 0; i < exact.size(); ++i)
    largest = std::max(largest, std::abs(static_cast<double>(grid.dose_gy()[i] / exact[i]) - 1));
  row.more["largest_error_percent"] = 100 * largest;
  state.counters["largest_error_percent"] = 100 * largest;
  report.rows.push_back(row);
}

/// Every structure's voxels' doses, sorted.
double sort_structures(const std::vector<StructureVoxels>& structures, const DoseGrid& grid) {
  double sum = 0;
  for (const StructureVoxels& voxels : structures) {
    std::vector<std::pair<double, double>> doses;
    for (const std::uint32_t v : voxels.whole) doses.emplace_back(static_cast<double>(grid.dose_gy()[v]), 1);
    for (const auto& part : voxels.parts) doses.emplace_back(grid.at(part.centre), part.volume_mm3);
    std::ranges::sort(doses);
    sum += doses[doses.size() / 10].first;
  }
  return sum;
}

void run_evaluate(benchmark::State& state, Report& report, const BenchOptions& options) {
  const Implant& made = implant(options.cases.dose_points);
  ImplantDose dose(made.structures,
                   {.prescription_gy = kPrescriptionGy, .spacing_mm = 1, .margin_mm = 10, .source = {}});
  for (const DoseSeed& seed : made.seeds) dose.add(seed);
  std::vector<StructureVoxels> voxels;
  for (const Structure& s : made.structures)
    voxels.push_back(structure_voxels(SurfaceBvh(s.mesh), dose.grid()));
  Row row{.name = "dose/evaluate",
          .kernel = "6711",
          .points = dose.grid().dose_gy().size(),
          .landmarks = kSeeds,
          .support_mm = 0};
  time_row(state, row, {.run = [&] { benchmark::DoNotOptimize(dose.evaluate()); }},
           {.run = [&] { benchmark::DoNotOptimize(sort_structures(voxels, dose.grid())); }});
  row.more["structures"] = static_cast<double>(made.structures.size());
  report.rows.push_back(row);
}

/// The exact points' own V100 and D90.
double exact_v100(const Implant& made) {
  const auto count = std::ranges::count_if(made.exact_gy, [](double gy) { return gy >= kPrescriptionGy; });
  return 100.0 * static_cast<double>(count) / static_cast<double>(made.exact_gy.size());
}
double exact_d90(const Implant& made) {
  std::vector<double> doses = made.exact_gy;
  const auto at = doses.begin() + static_cast<std::ptrdiff_t>(doses.size() / 10);
  std::ranges::nth_element(doses, at);
  return *at;
}

void run_spacing(benchmark::State& state, Report& report, const BenchOptions& options, double spacing_mm) {
  const Implant& made = implant(options.cases.dose_points);
  ImplantDose dose(
      made.structures,
      {.prescription_gy = kPrescriptionGy, .spacing_mm = spacing_mm, .margin_mm = 10, .source = {}});
  for (const DoseSeed& seed : made.seeds) dose.add(seed);
  const StructureDose gland = dose.evaluate().front();
  double difference = 0;
  for (std::size_t i = 0; i < made.points.size(); ++i)
    difference += std::abs(dose.grid().at(made.points[i]) / made.exact_gy[i] - 1);
  std::vector<float> exact(dose.grid().dose_gy().size());
  std::size_t next = 0;
  const std::vector<double> ms =
      time_in_turns(state, {{.run = [&] { dose.add(made.seeds[next++ % kSeeds]); }},
                            {.run = [&] { add_exactly(dose.grid(), made.seeds[0], exact); }},
                            {.run = [&] { benchmark::DoNotOptimize(dose.evaluate()); }}});
  Row row{.name = "dose/spacing",
          .kernel = "6711",
          .points = exact.size(),
          .landmarks = kSeeds,
          .support_mm = 0,
          .ms = ms[0],
          .baseline_ms = ms[1]};
  row.more = {{"spacing_mm", spacing_mm},
              {"evaluate_ms", ms[2]},
              {"v100_percent", gland.v100_percent},
              {"v100_error_percent", 100 * (gland.v100_percent / exact_v100(made) - 1)},
              {"d90_gy", gland.d90_gy},
              {"d90_error_percent", 100 * (gland.d90_gy / exact_d90(made) - 1)},
              {"mean_error_percent", 100 * difference / static_cast<double>(made.points.size())}};
  state.counters["median_ms"] = row.ms;
  state.counters["baseline_ms"] = row.baseline_ms;
  for (const auto& [name, value] : row.more) state.counters[name] = value;
  report.rows.push_back(row);
}

}  // namespace

void add_dose_benches(Report& report, const BenchOptions& options) {
  add_benchmark(report, "dose/seed/1.0mm",
                [&report, options](benchmark::State& state) { run_seed(state, report, options); });
  add_benchmark(report, "dose/evaluate/1.0mm",
                [&report, options](benchmark::State& state) { run_evaluate(state, report, options); });
  for (const double spacing_mm : options.cases.dose_spacings_mm) {
    std::string name = std::to_string(spacing_mm);
    name.erase(name.find('.') + 2);
    add_benchmark(report, "dose/spacing/" + name + "mm",
                  [&report, options, spacing_mm](benchmark::State& state) {
                    run_spacing(state, report, options, spacing_mm);
                  });
  }
}

}  // namespace brachy::bench
