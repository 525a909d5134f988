#include "apps/daemon/loops/tick_field.h"

#include <utility>

#include "core/simulation/make_guarded_field.h"

namespace brachy {

bool TickField::take(const ImagedTick& tick, const RunModel& model) {
  is_taken_ = false;
  if (!model_ || run_ != tick.run) {
    if (model.run != tick.run) return false;
    std::shared_ptr<const SimulationModel> next = model.model.lock();
    if (!next) return false;
    if (next != model_) field_ = make_guarded_field(*next);
    model_ = std::move(next);
    run_ = tick.run;
  }
  is_taken_ = static_cast<bool>(field_->update(tick.landmarks));
  return is_taken_;
}

}  // namespace brachy
