#include "core/scene/load_plan.h"

#include "core/base/error.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/seeds/seed_file.h"

namespace brachy {

std::optional<Plan> load_plan(const Scene& scene) {
  if (scene.plan_file.empty() || scene.implant.is_hdr()) return {};
  const auto file = scene.resolve(scene.plan_file);
  Plan plan = load_plan(file, scene.template_grid, scene.needle.length_mm);
  const std::size_t there = load_seeds_at_start(scene).size();
  const std::size_t most = static_cast<std::size_t>(scene.seeds.max_count);
  if (plan.seed_count() + there > most)
    throw UserError(file.string() + ": " + std::to_string(plan.seed_count()) + " seeds" +
                    (there > 0 ? ", beside " + std::to_string(there) + " of implant.seeds" : "") +
                    ", but the scene allows " + std::to_string(most) + "; raise seeds.max_count");
  return plan;
}

std::vector<Seed> load_seeds_at_start(const Scene& scene) {
  if (scene.implant.seeds.empty()) return {};
  const auto file = scene.resolve(scene.implant.seeds);
  std::vector<Seed> seeds = seeds_at_start(at_rest(load_seeds_in_place(file)));
  const auto most = static_cast<std::size_t>(scene.seeds.max_count);
  if (seeds.size() > most)
    throw UserError(file.string() + ": " + std::to_string(seeds.size()) + " seeds, but the scene allows " +
                    std::to_string(most) + "; raise seeds.max_count");
  return seeds;
}

std::optional<HdrPlan> load_hdr_plan(const Scene& scene) {
  if (scene.plan_file.empty() || !scene.implant.is_hdr()) return {};
  const auto file = scene.resolve(scene.plan_file);
  HdrPlan plan = load_hdr_plan(file, scene.template_grid, scene.needle.length_mm);
  if (plan.catheters.size() > scene.needle.count)
    throw UserError(file.string() + ": " + std::to_string(plan.catheters.size()) +
                    " catheters, but the scene has " + std::to_string(scene.needle.count) +
                    " needles; raise needle.count");
  return plan;
}

SeedMisplacement seed_misplacement(const Scene& scene) {
  const NoiseSettings& noise = scene.noise;
  return {noise.template_play_mm, noise.drop_along_mm, noise.drop_across_mm, noise.migration_along_mm};
}

}  // namespace brachy
