#pragma once

#include <cstdint>

namespace brachy {

struct SimulationModel;

/// A digest of what a run of `model` depends on besides its poses: settings, tissue, deformation model, what lies where
/// and the organs; not the plan, which is part of the run's state, nor threads and SIMD. A saved state has it
/// (Simulator::save), so that no other scene goes on from it. FNV-1a, 64 bits: against mistakes, not against forgery.
/// What lies where, and tissues' weights, are sampled on a lattice, every 2 to 3 mm in a gland.
/// Threads: any. Not real-time.
std::uint64_t digest_of(const SimulationModel& model);

}  // namespace brachy
