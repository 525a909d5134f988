#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/brachytherapy/structures/organ_contacts.h"
#include "core/needle/body_frame.h"
#include "core/simulation/instruments.h"
#include "core/simulation/simulation_model.h"

namespace brachy {

/// Every needle against every organ of the scene, in every tick (OrganContacts).
/// Threads: one. Real-time: as OrganContacts.
class OrganTests {
 public:
  /// `model` must outlive this.
  explicit OrganTests(const SimulationModel& model);

  /// After the shapes of tick `tick` are found. `frame`: where the body is.
  void update(std::uint64_t tick, const Instruments& instruments, const BodyFrame& frame) noexcept;
  /// Of needle n and SimulationModel::organs[k] at n × organs + k.
  const std::vector<OrganContact>& contacts() const { return states_; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(tests_, states_);
  }

 private:
  const SimulationModel& model_;
  std::vector<OrganContacts> tests_;  // by needle
  std::vector<OrganContact> states_;
};

}  // namespace brachy
