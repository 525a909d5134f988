#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/brachytherapy/seeds/implant.h"
#include "core/brachytherapy/seeds/seed_loading.h"
#include "core/models/guard/guarded_field.h"
#include "core/simulation/instruments.h"
#include "core/simulation/mesh_state.h"
#include "core/simulation/shown_mesh.h"
#include "core/simulation/simulation_model.h"

namespace brachy {

/// The seeds of a run: in the needles, in the tissue, and those that were asked for and are not in the body.
/// Threads: one. Real-time: no allocation after construction.
class SeedDrops {
 public:
  /// The tissue as a tick has deformed it. Its field is in the body's frame.
  struct DeformedTissue {
    GuardedField& field;
    const BodyFrame& frame;
    const ShownMesh& mesh;
  };

  /// With the seeds that are there at the start. `model` must outlive this. Throws UserError as restore.
  explicit SeedDrops(const SimulationModel& model);

  /// Puts the seeds of an earlier run, in the order of their drops, into the tissue in place of those at the start,
  /// which are among them, and removes them from their needles. Throws UserError where they are more than
  /// seeds.max_count.
  void restore(std::span<const Seed> seeds);
  /// The same for seeds that an earlier run lost: indices in Plan::seeds.
  void restore_lost(std::span<const std::int32_t> planned);
  /// As SeedLoading::set_plan.
  void set_plan(const LoadingPlan& plan) noexcept { loading_.set_plan(plan); }
  /// Goes on from `other`, of the same scene, in tick `tick` with the tissue as it is.
  void resume_from(const SeedDrops& other, std::uint64_t tick, GuardedField& field,
                   const BodyFrame& frame) noexcept;

  /// Moves the seeds in the tissue to where tick `tick` has put their material points.
  void move(std::uint64_t tick, GuardedField& field, const BodyFrame& frame) noexcept;
  /// Drops what the needles' buttons ask for in tick `tick`, after its deformation. Each needle's state counts them.
  void drop(std::uint64_t tick, Instruments& instruments, const DeformedTissue& tissue) noexcept;
  /// Brings slots up to date that have the seeds of tick `since`.
  void write(std::uint64_t since, SeedStates& seeds, FailedDrops& failed) const noexcept;

  std::span<const Seed> in_tissue() const { return implant_.seeds(); }
  std::size_t max_count() const { return implant_.max_count(); }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(loading_, implant_, failed_);
  }

 private:
  void drop_one(std::uint64_t tick, std::size_t needle, const SeedDrop& due, Instruments& instruments,
                const DeformedTissue& tissue) noexcept;
  Seed falling(std::uint64_t tick, std::size_t needle, const SeedDrop& due, const Instruments& instruments,
               const ShownMesh& mesh) const noexcept;
  void refuse(std::uint64_t tick, std::size_t needle, DropRefusal why, const Vec3& at, std::int32_t planned,
              DropCounts& counts) noexcept;

  const SimulationModel& model_;
  SeedLoading loading_;
  Implant implant_;
  FailedDrops failed_;
};

}  // namespace brachy
