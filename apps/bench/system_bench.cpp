// The landmark system by itself (ψ3,1): one landmark more against factorizing from scratch, and sparse against
// dense. Compare within one run.
#include <algorithm>
#include <cmath>
#include <random>

#include "apps/bench/benches.h"
#include "apps/bench/paper_baseline.h"
#include "apps/bench/turns.h"
#include "core/solve/rbf_system.h"

namespace brachy::bench {
namespace {

using Points = std::vector<Vec3> (*)(int);
using Sparse = RbfSystem::Sparse;

/// The first n points of a cubic grid of 1 mm, each moved by up to 0.2 mm an axis, that lie in a gland's ellipsoid.
std::vector<Vec3> in_volume(int n) {
  std::mt19937_64 random(1);
  const auto jitter = [&] { return 0.4 * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5); };
  const double scale = std::cbrt(n / (4.0 / 3 * M_PI * 20 * 16 * 19)) * 1.01;
  std::vector<Vec3> p;
  for (int x = -30; x <= 30; ++x)
    for (int y = -30; y <= 30; ++y)
      for (int z = -30; z <= 30; ++z) {
        const Vec3 q(x + jitter(), y + jitter(), z + jitter());
        if ((q / scale).cwiseQuotient(Vec3(20, 16, 19)).norm() < 1) p.push_back(q);
      }
  std::shuffle(p.begin(), p.end(), random);
  p.resize(static_cast<std::size_t>(n));
  return p;
}

/// n random points in the ellipsoid, at least 1 mm apart.
std::vector<Vec3> at_random(int n) {
  std::mt19937_64 random(2);
  const auto coordinate = [&] { return 2 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1; };
  const double scale = std::cbrt(n / 0.6 / (4.0 / 3 * M_PI * 20 * 16 * 19));  // 0.6 a mm³ still fit
  std::vector<Vec3> p;
  while (static_cast<int>(p.size()) < n) {
    const Vec3 q(coordinate(), coordinate(), coordinate()), x = scale * q.cwiseProduct(Vec3(20, 16, 19));
    if (q.norm() < 1 && std::ranges::all_of(p, [&](const Vec3& y) { return (x - y).norm() >= 1; }))
      p.push_back(x);
  }
  return p;
}

/// n points about 1 mm apart on the ellipsoid itself.
std::vector<Vec3> on_surface(int n) {
  const double scale = std::sqrt(n / 4200.0);  // its area is 4,200 mm²
  std::vector<Vec3> p;
  for (int k = 0; k < n; ++k) {
    const double z = 1 - (2.0 * k + 1) / n, r = std::sqrt(1 - z * z),
                 t = 2.399963229728653 * k;  // golden angle
    p.push_back(scale * Vec3(20 * r * std::cos(t), 16 * r * std::sin(t), 19 * z));
  }
  return p;
}

/// Landmarks and their support, 4 spacings of 1 mm, common to all measurements here.
struct Cloud {
  std::string name;
  std::vector<Vec3> positions;
  static constexpr double kSupport = 4;  // mm

  RbfSystem system(SimdTarget target, Sparse sparse) const {
    return {Wendland31{}, kSupport, static_cast<int>(positions.size()), target, sparse};
  }
};

void check(benchmark::State& state, const FactorStatus& status) {
  if (!status) state.SkipWithError("not positive definite");
}

Row row_of(const std::string& work, const Cloud& cloud) {
  return {
      .name = work + "/" + cloud.name, .landmarks = cloud.positions.size(), .support_mm = Cloud::kSupport};
}

/// One landmark more, and one of those in the middle less, against factorizing all of them from scratch.
void run_changes(benchmark::State& state, Report& report, SimdTarget target, const Cloud& cloud) {
  const auto& p = cloud.positions;
  const auto before = std::span(p).first(p.size() - 1);
  RbfSystem appended = cloud.system(target, Sparse::kNever), removed = cloud.system(target, Sparse::kNever),
            from_scratch = cloud.system(target, Sparse::kNever);
  const auto ms = time_in_turns(state, {{.run = [&] { check(state, appended.append(p.back())); },
                                         .prepare = [&] { check(state, appended.refactorize(before)); }},
                                        {.run = [&] { removed.remove(static_cast<int>(p.size() / 2)); },
                                         .prepare = [&] { check(state, removed.factorize(p)); }},
                                        {[&] { check(state, from_scratch.factorize(p)); }}});
  for (int k = 0; k < 2; ++k) {
    Row row = row_of(k == 0 ? "append" : "remove", cloud);
    row.ms = ms[static_cast<std::size_t>(k)];
    row.baseline_ms = ms[2];
    state.counters[row.name] = row.ms / row.baseline_ms;
    report.rows.push_back(row);
  }
}

/// Sparse against dense factorisation, both ours, and the paper's; and whether their solutions are the same.
void run_sparse(benchmark::State& state, Report& report, SimdTarget target, const Cloud& cloud) {
  const auto& p = cloud.positions;
  RbfSystem sparse = cloud.system(target, Sparse::kAlways), dense = cloud.system(target, Sparse::kNever);
  PaperBaseline paper("psi31", Cloud::kSupport);
  const std::vector<Vec3> zero(p.size(), Vec3::Zero());
  const auto ms = time_in_turns(state, {{[&] { check(state, sparse.factorize(p)); }},
                                        {[&] { check(state, dense.factorize(p)); }},
                                        {[&] { paper.solve(p, zero); }}});
  Row row = row_of("sparse", cloud);
  row.ms = ms[0];
  row.baseline_ms = ms[1];
  row.more["paper_ms"] = ms[2];
  state.counters["ratio"] = row.ratio();
  std::vector<Vec3> d, by_sparse(p.size()), by_dense(p.size());
  for (const Vec3& x : p) d.emplace_back(std::sin(x.y()), std::cos(x.z()), std::sin(x.x() + x.y()));
  sparse.solve(d, by_sparse);
  dense.solve(d, by_dense);
  double& difference = row.more["difference_mm"];
  for (std::size_t i = 0; i < p.size(); ++i)
    difference = std::max(difference, (by_sparse[i] - by_dense[i]).cwiseAbs().maxCoeff());
  report.rows.push_back(row);
}

}  // namespace

void add_system_benches(Report& report, const BenchOptions& options) {
  const auto add = [&](auto run, const std::string& work, const char* name, Points points, int n) {
    add_benchmark(report, "system/" + work + "/" + name + "/n:" + std::to_string(n),
                  [&report, target = options.target, run, name, points, n](benchmark::State& state) {
                    run(state, report, target, Cloud{name, points(n)});
                  });
  };
  add(run_changes, "change", "volume", in_volume, 1000);
  add(run_sparse, "sparse", "volume", in_volume, 2000);
  add(run_sparse, "sparse", "random", at_random, 2000);
  add(run_sparse, "sparse", "surface", on_surface, 2000);
}

}  // namespace brachy::bench
