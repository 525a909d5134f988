#pragma once

#include <memory>
#include <vector>

#include "core/brachytherapy/structures/structure.h"
#include "core/geometry/tissue/tissue.h"
#include "core/scene/scene.h"
#include "core/ultrasound/ultrasound_imager.h"

namespace brachy {

/// What the scene's ultrasound meets, made of its structures (load_structures) or of the volume that it names. Takes up
/// to a second, a volume some more. Not real-time.
/// Errors: UserError where there is no prostate, or the volume cannot be used (read_nrrd_file, EchoMap).
std::shared_ptr<const EchoMap> load_echo_map(const Scene& scene, const std::vector<Structure>& structures);

/// The scene's scanner: probe, needles and settings of [ultrasound]. Threads and target are engine's.
UltrasoundImager::Options imager_options(const Scene& scene);

/// Where the scene's probe is while it has no pose.
RigidTransform resting_probe(const Scene& scene, const Tissue& tissue);

}  // namespace brachy
