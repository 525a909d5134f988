// The landmark system by itself (ψ3,1): one landmark more against factorizing anew, and sparse against dense. Compare
// within one run.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/rbf/rbf_system.h"

namespace brachy::bench {
namespace {

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
  const double scale = std::cbrt(n / 0.6 / (4.0 / 3 * M_PI * 20 * 16 * 19));  // 0.6 a mm³ still find room
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

void factorize(benchmark::State& state, const std::vector<Vec3>& p, double support, Sparse sparse) {
  RbfSystem system(Wendland31{}, support, static_cast<int>(p.size()), best_simd_target(), sparse);
  for (auto _ : state)
    if (!system.factorize(p)) state.SkipWithError("not positive definite");
  state.counters["sparse"] = system.is_sparse();
}

void append(benchmark::State& state, const std::vector<Vec3>& p, double support, Sparse sparse) {
  RbfSystem system(Wendland31{}, support, static_cast<int>(p.size()), best_simd_target(), sparse);
  if (!system.factorize(std::span(p).first(p.size() - 1))) state.SkipWithError("not positive definite");
  for (auto _ : state) {
    if (!system.append(p.back())) state.SkipWithError("not positive definite");
    system.remove(system.size() - 1);  // the last one: clears its row
  }
}

void remove(benchmark::State& state, const std::vector<Vec3>& p, double support, Sparse sparse) {
  RbfSystem system(Wendland31{}, support, static_cast<int>(p.size()), best_simd_target(), sparse);
  std::size_t index = 0;
  for (auto _ : state) {
    if (system.size() < static_cast<int>(p.size()) - 10) index = 0;
    if (index == 0) {
      state.PauseTiming();
      if (!system.factorize(p)) state.SkipWithError("not positive definite");
      state.ResumeTiming();
    }
    system.remove(static_cast<int>(++index * 37 % p.size() / 2));
  }
}

using Points = std::vector<Vec3> (*)(int);
const struct {
  const char* name;
  Points points;
} kClouds[] = {{"grid", in_volume}, {"random", at_random}, {"surface", on_surface}};
const struct {
  const char* name;
  Sparse sparse;
} kWays[] = {{"dense", Sparse::kNever}, {"sparse", Sparse::kAlways}};
const struct {
  const char* name;
  void (*run)(benchmark::State&, const std::vector<Vec3>&, double, Sparse);
} kWorks[] = {{"Factorize", factorize}, {"Append", append}, {"Remove", remove}};

const bool registered = [] {
  for (const int n : {1000, 2000})
    for (const auto& cloud : kClouds)
      for (const auto& way : kWays)
        for (const auto& work : kWorks)
          benchmark::RegisterBenchmark(
              (std::string("System") + work.name + "/" + cloud.name + "/" + way.name + "/" +
               std::to_string(n))
                  .c_str(),
              [&, n](benchmark::State& state) { work.run(state, cloud.points(n), 4, way.sparse); })
              ->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace brachy::bench
