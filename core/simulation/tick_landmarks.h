#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/needle/contact_solve.h"
#include "core/needle/needle_order.h"
#include "core/simulation/body_motion.h"
#include "core/simulation/instruments.h"
#include "core/simulation/simulation_model.h"
#include "core/solve/anchors.h"

namespace brachy {

/// The landmarks of a tick, gathered from the instruments and the anchors in an order that changes little from tick to
/// tick (LandmarkSet).
/// Threads: one. Real-time: no allocation after construction.
class TickLandmarks {
 public:
  /// `gives_way`: TissueField::gives_way of the field that the landmarks are for.
  TickLandmarks(const SimulationModel& model, bool gives_way);

  /// Gathers them once the instruments' contacts have begun: displaced as if all that sticks stuck and the body stayed
  /// where it is. Where no instrument touches the tissue there are none at all: anchors alone displace nothing.
  void gather(Instruments& instruments, const BodyMotion& body) noexcept;

  LandmarkSet& set() { return set_; }
  const LandmarkSet& set() const { return set_; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(anchors_, order_, set_);
  }

 private:
  void add_anchors(const Instruments& instruments) noexcept;
  bool keep_clear(Vec3& anchor, const Instruments& instruments) const noexcept;
  void add_probe(Instruments& instruments, const BodyMotion& body) noexcept;
  void add_needle(Instruments& instruments, std::size_t n, bool tip, const BodyMotion& body) noexcept;
  void add(NeedleLandmark& landmark, const LandmarkSpread& spread, LandmarkSet::Owner owner,
           std::int32_t beam, const BodyMotion& body) noexcept;

  double period_s_;
  bool gives_way_;
  Anchors anchors_;
  double anchor_clearance_;  // mm
  WorkBudget budget_;
  NeedleOrder order_;
  std::vector<std::int32_t> last_on_shaft_;  // of each needle, its landmark behind the tip; −1: none
  std::vector<std::int32_t> beams_;          // of each needle, in set_.compliance; −1: it does not bend
  LandmarkSet set_;
};

}  // namespace brachy
