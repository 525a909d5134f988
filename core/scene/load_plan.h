#pragma once

#include <optional>
#include <vector>

#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/robust/uncertainty.h"
#include "core/brachytherapy/seeds/seed.h"
#include "core/scene/scene.h"

namespace brachy {

/// The scene's plan of seeds, if it has one: none where implant.kind is "hdr". Errors: UserError; also where it has
/// more seeds than seeds.max_count.
std::optional<Plan> load_plan(const Scene& scene);
/// The scene's plan of catheters, if it has one and implant.kind is "hdr". Errors: UserError; also where needle.count
/// is less than its catheters.
std::optional<HdrPlan> load_hdr_plan(const Scene& scene);

/// The seeds that the scene has in the body at the start (implant.seeds); empty: none. Errors: UserError, also where
/// there are more than seeds.max_count.
std::vector<Seed> load_seeds_at_start(const Scene& scene);

/// How seeds are misplaced by the scene's [noise], whether it is on or not.
SeedMisplacement seed_misplacement(const Scene& scene);

}  // namespace brachy
