#pragma once

#include <memory>

#include "core/geometry/tissue/tissue.h"
#include "core/scene/scene.h"
#include "core/ultrasound/ultrasound_imager.h"

namespace brachy {

/// What the scene's ultrasound meets, made of its structures. Takes up to a second. Not real-time.
/// Errors: UserError as load_structures.
std::shared_ptr<const EchoMap> load_echo_map(const Scene& scene);

/// The scene's scanner: probe, needles and settings of [ultrasound]. Threads and target are engine's.
UltrasoundImager::Options imager_options(const Scene& scene);

/// Where the scene's probe is while it has no pose.
RigidTransform resting_probe(const Scene& scene, const Tissue& tissue);

}  // namespace brachy
