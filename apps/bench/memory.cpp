#include "apps/bench/memory.h"

#include <malloc.h>

#include "apps/bench/workload.h"
#include "core/scene/load_simulation_model.h"
#include "core/simulation/simulator.h"

namespace brachy::bench {
namespace {

constexpr std::size_t kFew = 500'000, kMany = 1'000'000;

/// Bytes allocated now. Exact, where the resident size would depend on what the allocator retains.
double heap_bytes() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

struct Bytes {
  double simulator = 0, mesh_state = 0;
};

Bytes bytes_of(std::size_t points) {
  Tissue tissue = phantom(points);
  tissue.rest_vertices.shrink_to_fit();
  const double before = heap_bytes();
  const auto simulator = std::make_unique<Simulator>(load_simulation_model(Scene{}, tissue));
  const double between = heap_bytes();
  const MeshState state = simulator->initial_state();
  return {between - before, heap_bytes() - between};
}

}  // namespace

std::map<std::string, double> measure_memory() {
  std::map<std::string, double> memory;
  std::map<std::size_t, Bytes> at;
  for (const std::size_t points : {kPaperPoints, kFew, kMany}) {
    at[points] = bytes_of(points);
    memory["simulator_bytes_at_" + std::to_string(points)] = at[points].simulator;
  }
  constexpr double kMore = kMany - kFew;
  memory["simulator_bytes_per_point"] = (at[kMany].simulator - at[kFew].simulator) / kMore;
  memory["mesh_state_bytes_per_point"] = (at[kMany].mesh_state - at[kFew].mesh_state) / kMore;
  return memory;
}

}  // namespace brachy::bench
