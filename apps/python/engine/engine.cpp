#include "apps/python/engine/engine.h"

#include <algorithm>

#include "core/scene/load_simulation_model.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_tissue.h"

namespace brachy {

Engine::Engine(const Scene& scene, bool with_hash)
    : Engine(scene, load_simulation_model(scene, load_tissue(scene).tissue), with_hash) {}

Engine::Engine(const Engine& like, bool with_hash) : Engine(like.scene_, like.model_, with_hash) {}

Engine::Engine(Scene scene, std::shared_ptr<const SimulationModel> model, bool with_hash)
    : scene_(std::move(scene)), model_(std::move(model)) {
  simulator_ = std::make_unique<Simulator>(model_);
  simulator_->save(at_rest_);
  state_ = simulator_->initial_state();
  rest_ = state_.mesh.deformed_vertices;
  if (with_hash) hash_.emplace();
}

void Engine::reset() {
  simulator_->restore(at_rest_);
  const MeshState rest = simulator_->initial_state();
  // Copied in place, since views of the vertices stay valid.
  std::ranges::copy(rest.mesh.deformed_vertices, state_.mesh.deformed_vertices.begin());
  std::ranges::copy(rest.mesh.block_ticks, state_.mesh.block_ticks.begin());
  state_.summary = rest.summary;
  state_.seeds = rest.seeds;
  state_.needles = rest.needles;
  if (hash_) hash_.emplace();
  if (dose_) dose_->clear();
}

void Engine::step(std::span<const NeedlePose> poses) noexcept {
  simulator_->step(poses, state_);
  if (hash_) hash_->add(state_);
}

std::optional<std::uint64_t> Engine::hash() const {
  return hash_ ? std::optional(hash_->value()) : std::nullopt;
}

ImplantDose& Engine::updated_dose() {
  if (!dose_) {
    DoseSettings settings = scene_.dose;
    if (model_->plan) settings.prescription_gy = model_->plan->prescription_gy;
    dose_.emplace(load_structures(scene_), settings);
  }
  for (const Seed& seed : state_.seeds.in_tissue().subspan(dose_->seed_count())) dose_->add(seed.at_rest());
  return *dose_;
}

std::vector<StructureDose> Engine::dose() {
  return updated_dose().evaluate();
}

std::vector<double> Engine::dose_at(std::span<const Vec3> points) {
  const DoseGrid& grid = updated_dose().grid();
  std::vector<double> gy;
  for (const Vec3& p : points) gy.push_back(grid.at(p));
  return gy;
}

std::vector<std::pair<std::string, std::vector<double>>> Engine::depths_of(
    std::span<const Vec3> points) const {
  std::vector<std::pair<std::string, std::vector<double>>> all;
  const auto add = [&](const std::string& name, const SurfaceBvh& surface) {
    auto& depths = all.emplace_back(name, std::vector<double>()).second;
    for (const Vec3& p : points) depths.push_back(-surface.closest_point(p).signed_distance);
  };
  add("tissue", model_->surface);
  for (const TestedOrgan& organ : model_->organs) add(organ.name, *organ.surface);
  return all;
}

}  // namespace brachy
