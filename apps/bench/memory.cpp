#include "apps/bench/memory.h"

#include <malloc.h>

#include "apps/bench/workload.h"
#include "core/sim/simulator.h"

namespace brachy::bench {
namespace {

/// Bytes the program holds now. Exact, where the resident size would depend on what the allocator keeps back.
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
  const auto simulator = std::make_unique<Simulator>(Scene{}, tissue);
  const double between = heap_bytes();
  const MeshState state = simulator->initial_state();
  return {between - before, heap_bytes() - between};
}

}  // namespace

std::map<std::string, double> measure_memory() {
  const double few = 100'000, many = 1'000'000;
  const Bytes at_paper = bytes_of(kPaperPoints), at_few = bytes_of(100'000), at_many = bytes_of(1'000'000);
  return {{"simulator_bytes_per_point", (at_many.simulator - at_few.simulator) / (many - few)},
          {"mesh_state_bytes_per_point", (at_many.mesh_state - at_few.mesh_state) / (many - few)},
          {"simulator_bytes_at_14560", at_paper.simulator},
          {"simulator_bytes_at_100000", at_few.simulator},
          {"simulator_bytes_at_1000000", at_many.simulator}};
}

}  // namespace brachy::bench
