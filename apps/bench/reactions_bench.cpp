// What contact mechanics computes from a field in a tick: ours is axial_stiffness, the baseline the same matrix from m
// calls of reactions; the tip's moves make a new landmark set in between, whose cost is place_ms.
#include <cmath>
#include <memory>

#include "apps/bench/benches.h"
#include "apps/bench/turns.h"
#include "apps/bench/workload.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/matrix_models.h"

namespace brachy::bench {
namespace {

constexpr std::size_t kPerNeedle = 30;  // landmarks of one needle
constexpr double kTipCore = 8;          // mm

/// Needles side by side along z, the last one's tip a little further on at every tick, with a core of its own.
class Needles {
 public:
  explicit Needles(std::size_t n) : axes_(n, Vec3::UnitZ()) {
    std::vector<Vec3> positions;
    for (std::size_t i = 0; i < n; ++i) {
      const auto needle = static_cast<double>(i / kPerNeedle), row = static_cast<double>(i % kPerNeedle);
      positions.emplace_back(-8 + 8 * needle, 2 * std::fmod(needle, 2), -17 + 1.2 * row);
    }
    std::vector<LandmarkSpread> cores(n);
    cores.back().core_mm = kTipCore;
    landmarks_.assign(positions, std::vector<Vec3>(n, Vec3(0.1, 0, 1)), cores);
  }
  void advance() {
    landmarks_.positions.back().z() += (tick_++ % 16 < 8 ? 1e-3 : -1e-3);
    landmarks_.number();
    landmarks_.settle();
  }
  const LandmarkSet& landmarks() const { return landmarks_; }
  const std::vector<Vec3>& axes() const { return axes_; }

 private:
  LandmarkSet landmarks_;
  std::vector<Vec3> axes_;
  int tick_ = 0;
};

std::unique_ptr<TissueField> make_field(const Row& row, SimdTarget target) {
  const Tissue& tissue = phantom(row.points);
  if (is_matrix_model(row.kernel))
    return std::make_unique<MatrixKernelField>(
        tissue, row.kernel, ElasticBody{},
        MatrixKernelField::Options{.target = target, .max_landmarks = row.landmarks});
  return std::make_unique<ScalarKernelField>(
      tissue, *find_kernel(row.kernel), row.support_mm,
      BlockField::Options{.target = target, .max_landmarks = row.landmarks});
}

void run_axial_stiffness(benchmark::State& state, Report& report, SimdTarget target, Row row) {
  const std::unique_ptr<TissueField> field = make_field(row, target);
  Needles needles(row.landmarks);
  const std::size_t n = row.landmarks;
  Eigen::MatrixXd H(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n)), by_columns = H;
  std::vector<Vec3> d(n, Vec3::Zero()), f(n);
  const Work place{.run = [&] { field->factorize(needles.landmarks()); },
                   .prepare = [&] { needles.advance(); }};
  const Work update{.run = [&] { field->update(needles.landmarks()); },
                    .prepare = [&] { needles.advance(); }};
  const Work stiffness{.run = [&] { field->axial_stiffness(0, needles.axes(), H); }};
  const Work columns{.run = [&] {
    for (std::size_t j = 0; j < n; ++j) {
      d[j] = needles.axes()[j];
      field->solve(d, f);
      d[j] = Vec3::Zero();
      for (std::size_t i = 0; i < n; ++i)
        by_columns(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = f[i].dot(needles.axes()[i]);
    }
  }};
  const std::vector<double> ms = time_in_turns(state, {place, stiffness, columns, update});
  row.ms = ms[1];
  row.baseline_ms = ms[2];
  row.more["place_ms"] = ms[0];
  row.more["update_ms"] = ms[3];
  row.more["largest_difference"] = (H - by_columns).cwiseAbs().maxCoeff() / H.cwiseAbs().maxCoeff();
  state.counters["median_ms"] = row.ms;
  state.counters["baseline_ms"] = row.baseline_ms;
  for (const auto& [name, value] : row.more) state.counters[name] = value;
  report.rows.push_back(row);
}

}  // namespace

void add_reactions_benches(Report& report, const BenchOptions& options) {
  for (const char* model_name : {"psi31", "compact_elastic", "elastic"})
    for (const std::size_t n : options.cases.reaction_landmarks) {
      const Row row{.name = "axial_stiffness",
                    .kernel = model_name,
                    .points = kPaperPoints,
                    .landmarks = n,
                    .moving = true};
      const auto target = options.target;
      add_benchmark(report, name_of(row), [&report, target, row](benchmark::State& state) {
        run_axial_stiffness(state, report, target, row);
      });
    }
}

}  // namespace brachy::bench
