#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "core/models/step_flag.h"
#include "core/simulation/simulator.h"

namespace brachy {

/// What an ultrasound image of a tick is made of, handed from the deformation thread to the ultrasound thread, which
/// computes the field again from the landmarks: the simulator's own changes with every tick.
struct ImagedTick {
  /// Has space for what `simulator` can have.
  ImagedTick(const Simulator& simulator, const MeshState& state)
      : most_landmarks(simulator.model()->max_landmarks()),
        instruments(state.needles.states),
        slots(state.seeds.slots) {
    landmarks.reserve(most_landmarks);
  }
  ImagedTick(const ImagedTick& other)
      : most_landmarks(other.most_landmarks), instruments(other.instruments), slots(other.slots) {
    landmarks.reserve(most_landmarks);  // which copying would not keep
  }
  ImagedTick& operator=(const ImagedTick&) = delete;

  std::span<const Seed> seeds() const { return {slots.data(), seed_count}; }

  /// False, and nothing is worth publishing, where the tick's field is not that of its landmarks, or they are more than
  /// this has space for. Real-time: no allocation.
  bool copy_from(const Simulator& simulator, const MeshState& state) noexcept {
    const LandmarkSet& from = simulator.landmarks();
    if ((state.summary.step_flags & kStepSolveFailed) != 0 || from.positions.size() > most_landmarks)
      return false;
    run = state.summary.run;
    tick = state.summary.tick;
    landmarks = from;
    frame = simulator.body_frame();
    std::ranges::copy(state.needles.states, instruments.begin());
    std::ranges::copy(state.seeds.in_tissue(), slots.begin());
    seed_count = state.seeds.count;
    return true;
  }

  std::uint64_t run = 0, tick = 0;  ///< TickSummary's
  std::int64_t publish_ns = 0;      ///< monotonic clock (set by the loop)
  std::size_t most_landmarks = 0;
  LandmarkSet landmarks;
  BodyFrame frame;
  std::vector<NeedleState> instruments;  ///< needles, then the probe where the scene has one
  std::vector<Seed> slots;
  std::uint32_t seed_count = 0;
};

}  // namespace brachy
