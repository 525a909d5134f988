#pragma once

#include <memory>

#include "core/scene/scene.h"
#include "core/simulation/simulation_model.h"

namespace brachy {

/// The model that the scene describes, for `tissue` (load_tissue). Reads the files of regions and of the plan.
/// Takes up to some seconds (finite elements: `elastic` with regions or free faces, fem), of which set_up.progress
/// reports. Not real-time.
/// Errors: UserError where model.kernel is still "auto" (with_choice), scene and tissue do not fit (more anchors than
/// surface vertices, tissue outside the box), or a file cannot be used.
std::shared_ptr<const SimulationModel> load_simulation_model(const Scene& scene, Tissue tissue,
                                                             const SetUp& set_up = {});

/// The scene's anchors at rest in `tissue`: none where the kernel models what holds the tissue.
/// Errors: UserError where there are more of them than the surface has vertices.
Anchors load_anchors(const Scene& scene, const Tissue& tissue);

}  // namespace brachy
