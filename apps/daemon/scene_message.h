#pragma once

#include <optional>
#include <vector>

#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/structures/structure.h"
#include "core/scene/scene.h"
#include "net/wire/messages.h"

namespace brachy {

/// What viewers draw around the tissue: template, plan, all structures except the tissue itself; and the
/// kernels that an operator may choose.
net::SceneMessage make_scene_message(const Scene& scene, const std::optional<Plan>& plan,
                                     const std::vector<Structure>& structures);

}  // namespace brachy
