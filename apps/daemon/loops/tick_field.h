#pragma once

#include <cstdint>
#include <memory>

#include "apps/daemon/loops/imaged_tick.h"
#include "core/models/guard/guarded_field.h"
#include "core/simulation/simulation_model.h"

namespace brachy {

/// The model of a run. Other threads keep it only while they use it.
struct RunModel {
  std::uint64_t run = 0;
  std::weak_ptr<const SimulationModel> model;
};

/// The field of a tick, computed again for a thread beside the deformation thread, whose own changes with every tick.
/// Threads: one. Allocates where the run changes.
class TickField {
 public:
  /// `model`: of the newest run. False where that of the tick's run is not there, or the landmarks have no solution.
  bool take(const ImagedTick& tick, const RunModel& model);
  bool is_taken() const { return is_taken_; }  ///< the field is that of the last tick

  GuardedField& field() { return *field_; }
  const SimulationModel& model() const { return *model_; }
  Verdict verdict() const { return is_taken_ ? field_->certificate().verdict : Verdict::kUnknown; }

 private:
  std::uint64_t run_ = 0;
  std::shared_ptr<const SimulationModel> model_;  // null: none yet
  std::unique_ptr<GuardedField> field_;           // of it
  bool is_taken_ = false;
};

}  // namespace brachy
