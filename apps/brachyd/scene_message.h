#pragma once

#include <optional>
#include <vector>

#include "core/plan/plan.h"
#include "core/scene/scene.h"
#include "core/structures/structure.h"
#include "net/wire/messages.h"

namespace brachy {

/// What viewers are shown around the tissue: template, plan, all structures but the tissue itself, and the kernels that an
/// operator may choose.
net::SceneMessage make_scene_message(const Scene& scene, const std::optional<Plan>& plan,
                                     const std::vector<Structure>& structures);

}  // namespace brachy
