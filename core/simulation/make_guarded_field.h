#pragma once

#include <memory>

#include "core/models/guard/guarded_field.h"
#include "core/simulation/simulation_model.h"

namespace brachy {

/// The field of the model's deformation with the injectivity guard around it. `model` must outlive it. Not real-time:
/// it allocates. The tables that take long to make are the model's.
std::unique_ptr<GuardedField> make_guarded_field(const SimulationModel& model);

}  // namespace brachy
