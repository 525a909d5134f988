// Compiled with -ffp-contract=fast: a·b + c is one instruction where the target has it.
#include "apps/bench/machine_limits.h"

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <fstream>
#include <vector>

#define BRACHY_INLINE inline __attribute__((always_inline))

namespace brachy::bench {
namespace {

constexpr SimdTarget kTargets[] = {SimdTarget::kGeneric, SimdTarget::kSse4, SimdTarget::kAvx2,
                                   SimdTarget::kAvx512};
// two units with a latency of four cycles need eight; SSE and AVX2 have 16 registers
constexpr int kChains = 12;
constexpr int kRounds = 20'000;

template <int kLanes>
BRACHY_INLINE void multiply_adds() {
  typedef float Lanes __attribute__((vector_size(kLanes * sizeof(float))));
  Lanes sums[kChains], factor = Lanes{} + 0.999f, term = Lanes{} + 0.001f;
  asm volatile("" : "+m"(factor), "+m"(term));  // not known at compile time
  for (int c = 0; c < kChains; ++c) sums[c] = Lanes{} + static_cast<float>(c);
  for (int round = 0; round < kRounds; ++round)
#pragma GCC unroll 12
    for (int c = 0; c < kChains; ++c) sums[c] = sums[c] * factor + term;
  for (Lanes& sum : sums) asm volatile("" : : "m"(sum));  // used
}

void multiply_adds_generic() {
  multiply_adds<4>();
}
#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) void multiply_adds_avx2() {
  multiply_adds<8>();
}
__attribute__((target("avx512f,avx512vl,fma"))) void multiply_adds_avx512() {
  multiply_adds<16>();
}
#endif

template <class Run>
double seconds(Run run) {
  const auto start = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double multiply_add_gflops(SimdTarget target) {
  double best = 0;
  for (int i = 0; i < 30; ++i) {
    double operations = 0;
    const double s = seconds([&] { operations = run_multiply_adds(target); });
    best = std::max(best, operations / s * 1e-9);
  }
  return best;
}

double write_gb_per_s(std::size_t bytes, int times) {
  std::vector<float> buffer(bytes / sizeof(float));
  double best = 0;
  for (int i = 0; i < 10; ++i) {
    const double s = seconds([&] {
      for (int t = 0; t < times; ++t) {
        std::fill(buffer.begin(), buffer.end(), static_cast<float>(t));
        benchmark::DoNotOptimize(buffer.data());
        benchmark::ClobberMemory();
      }
    });
    best = std::max(best, static_cast<double>(bytes) * times / s * 1e-9);
  }
  return best;
}

struct Usage {
  double busy_s = 0, total_s = 0, own_s = 0;
};

Usage read_usage() {
  const double tick = static_cast<double>(sysconf(_SC_CLK_TCK));
  Usage usage;
  usage.own_s = static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
  std::ifstream file("/proc/stat");
  std::string cpu;
  file >> cpu;
  double value = 0;
  for (int field = 0; field < 8 && file >> value;
       ++field) {  // user nice system idle iowait irq softirq steal
    usage.total_s += value / tick;
    if (field != 3 && field != 4) usage.busy_s += value / tick;
  }
  return usage;
}

}  // namespace

OthersLoad::OthersLoad() {
  const Usage usage = read_usage();
  busy_s_ = usage.busy_s;
  total_s_ = usage.total_s;
  own_s_ = usage.own_s;
}

double OthersLoad::share() const {
  const Usage now = read_usage();
  const double total_s = now.total_s - total_s_;
  return total_s > 0 ? std::clamp((now.busy_s - busy_s_ - (now.own_s - own_s_)) / total_s, 0.0, 1.0) : 0;
}

std::string processor_name() {
  std::ifstream file("/proc/cpuinfo");
  std::string name = "unknown processor";
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) {
      name = line.substr(line.find(':') + 2);
      break;
    }
  return name + ", " + std::to_string(sysconf(_SC_NPROCESSORS_ONLN)) + " cores";
}

double run_multiply_adds(SimdTarget target) {
  int lanes = 4;
#if defined(__x86_64__)
  if (target == SimdTarget::kAvx2) {
    lanes = 8;
    multiply_adds_avx2();
  } else if (target == SimdTarget::kAvx512) {
    lanes = 16;
    multiply_adds_avx512();
  }
#endif
  if (lanes == 4) multiply_adds_generic();
  return 2.0 * lanes * kChains * kRounds;
}

SimdTarget fastest_target() {
  static const SimdTarget fastest = [] {
    SimdTarget best = SimdTarget::kGeneric;
    double most = 0;
    for (const SimdTarget target : kTargets)
      if (is_supported(target) && multiply_add_gflops(target) > most) {
        best = target;
        most = multiply_add_gflops(target);
      }
    return best;
  }();
  return fastest;
}

std::map<std::string, double> measure_limits() {
  std::map<std::string, double> limits;
  double& best = limits["fma_gflops"];
  for (const SimdTarget target : kTargets)
    if (is_supported(target)) {
      const double gflops = multiply_add_gflops(target);
      limits["fma_gflops_" + std::string(to_string(target))] = gflops;
      best = std::max(best, gflops);
    }
  constexpr std::size_t kPointBytes = 3 * sizeof(float);
  limits["write_gb_per_s"] = write_gb_per_s(std::size_t{256} << 20, 1);
  for (const std::size_t points : {14'560, 100'000, 1'000'000})
    limits["write_gb_per_s_" + std::to_string(points) + "_points"] =
        write_gb_per_s(points * kPointBytes, static_cast<int>(3'000'000 / points));
  return limits;
}

}  // namespace brachy::bench
