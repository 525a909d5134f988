#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/brachytherapy/dose/implant_dose.h"
#include "core/scene/scene.h"
#include "core/simulation/simulator.h"
#include "core/simulation/state_hash.h"

namespace brachy {

/// One run of a scene in the caller's process, with the state of its last tick: what the Python module shows.
/// Frame W (patient RAS), mm, N, s.
/// Threads: one at a time; the module sees to it. Not real-time, but step(), which is Simulator::step and, if asked
/// for, the state's hash.
class Engine {
 public:
  /// Loads meshes, regions and plan of the scene. `with_hash`: every tick is added to the hash, which takes longer
  /// than a tick of the cheapest models. Errors: UserError as load_tissue and load_simulation_model.
  Engine(const Scene& scene, bool with_hash);
  /// Another run of the scene of `like`, at rest. They share the model and its tables, which nobody changes: they may
  /// run on different threads.
  Engine(const Engine& like, bool with_hash);

  /// The tissue at rest again, tick 0, no seeds, a hash of nothing. Neither the model nor its field is made again.
  void reset();
  /// One tick with the instruments at `poses`, by id; fewer than the scene has: the others are not there.
  void step(std::span<const NeedlePose> poses) noexcept;

  const Scene& scene() const { return scene_; }
  const Simulator& simulator() const { return *simulator_; }
  const MeshState& state() const { return state_; }
  std::size_t instrument_count() const { return state_.needles.states.size(); }
  /// That `brachy replay --offline` prints for the same poses; nullopt without with_hash.
  std::optional<std::uint64_t> hash() const;
  /// 3N floats at rest, in the order of the state's mesh.
  const std::vector<float>& rest_positions() const { return rest_; }

  /// The dose of the seeds that fell so far, at rest, structure by structure. The first call takes some 0.1 s, each
  /// further seed about 1 ms. Errors: UserError as load_structures.
  std::vector<StructureDose> dose();
  /// Gy at each of `points`; NaN outside the grid around the prostate.
  std::vector<double> dose_at(std::span<const Vec3> points);

  /// By how much each of `points`, at rest, lies inside the tissue ("tissue", the first) and inside each organ that
  /// needles are tested against, mm; < 0 outside.
  std::vector<std::pair<std::string, std::vector<double>>> depths_of(std::span<const Vec3> points) const;

 private:
  Engine(Scene scene, std::shared_ptr<const SimulationModel> model, bool with_hash);
  ImplantDose& updated_dose();

  Scene scene_;
  std::shared_ptr<const SimulationModel> model_;
  std::unique_ptr<Simulator> simulator_;
  std::vector<std::byte> at_rest_;  // the simulator's state, which reset() restores
  MeshState state_;  // its vectors keep their place from reset to reset: Python has views of them
  std::optional<StateHash> hash_;
  std::vector<float> rest_;
  std::optional<ImplantDose> dose_;
};

}  // namespace brachy
