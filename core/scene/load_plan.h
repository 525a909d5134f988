#pragma once

#include <optional>

#include "core/brachytherapy/plan/plan.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene's plan, if it has one. Errors: UserError; also where it has more seeds than seeds.max_count.
std::optional<Plan> load_plan(const Scene& scene);

}  // namespace brachy
