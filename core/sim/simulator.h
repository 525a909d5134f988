#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "core/contact/contact_solve.h"
#include "core/contact/needle_contact.h"
#include "core/contact/needle_tissues.h"
#include "core/rbf/anchors.h"
#include "core/scene/scene.h"
#include "core/seeds/implant.h"
#include "core/seeds/seed_loading.h"
#include "core/sim/mesh_state.h"
#include "core/stability/guarded_field.h"
#include "core/surface/surface_bvh.h"
#include "core/tissue/tissue.h"

namespace brachy {

/// The scene's anchors at rest in `tissue`: none where the kernel knows what holds the tissue. Throws UserError where
/// the scene has more of them than the surface has vertices.
Anchors make_anchors(const Scene& scene, const Tissue& tissue);

/// The simulation: poses → contact → landmarks → stick and slip → field → seeds → mesh state, one tick a call.
///
/// A plain function of its arguments and its own memory, which is the needles' contact, the anchors' λ and the last
/// field; every tick's field is computed from the rest shape. The same poses give the same states, bit for bit, on
/// every run and for any number of threads.
/// Threads: one caller (OpenMP inside, if the scene asks). Real-time: step does not allocate, lock, throw or read a
/// clock.
class Simulator {
 public:
  /// `scene` as load_scene checked it. Throws UserError where scene and tissue do not fit (more anchors than surface
  /// vertices, tissue outside the box) or a region's file cannot be read.
  Simulator(const Scene& scene, Tissue tissue);
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  /// Seeds of an earlier run, in the order of falling: in the tissue from the start, and gone from their needles. Before the
  /// first step and before initial_state. Throws UserError where they are more than seeds.max_count.
  void restore_seeds(std::span<const Seed> seeds);

  /// Goes on where `other`, of the same scene with another model, stands: with its time, its seeds, what the needles hold.
  /// The tissue is at rest, and needles in it are put in anew. Before the first step. Real-time: as step.
  void go_on_from(const Simulator& other) noexcept;

  /// The tissue at rest, tick 0: what every slot handed to step must have started as.
  MeshState initial_state() const;

  /// One tick with the needles at `poses`, by id (not present, or fewer than the scene has: no needle). `state` is a slot
  /// that only this simulator has written since initial_state, however many ticks ago: blocks that it lacks are brought
  /// up to date.
  void step(std::span<const NeedlePose> poses, MeshState& state) noexcept;
  /// The same for a scene of one needle.
  void step(const NeedlePose& pose, MeshState& state) noexcept { step(std::span(&pose, 1), state); }

  const Tissue& tissue() const { return tissue_; }
  SimdTarget simd_target() const { return field_->target(); }
  /// Ticks evaluated in each way since construction, indexed by Evaluation.
  const std::array<std::uint64_t, 4>& evaluation_counts() const { return evaluation_counts_; }
  double period_s() const { return period_s_; }

 private:
  void touch(std::span<const NeedlePose> poses) noexcept;
  void gather_landmarks() noexcept;
  bool keep_clear(Vec3& anchor) const noexcept;
  void deform() noexcept;
  void apply_field() noexcept;
  bool apply_block(std::uint32_t b) noexcept;
  void drop_seeds() noexcept;
  void drop(std::size_t needle, const SeedDrop& due) noexcept;
  void refuse_drop(std::size_t needle, DropRefusal why) noexcept;
  Vec3 mean_displacement() const noexcept;
  void write(MeshState& state) noexcept;

  Tissue tissue_;
  SurfaceBvh surface_;
  double period_s_;
  NeedleTissues needle_tissues_;
  std::vector<NeedleContact> contacts_;  // by needle
  ContactSolve contact_solve_;
  Anchors anchors_;
  double anchor_clearance_;
  std::unique_ptr<GuardedField> field_;
  SeedLoading seed_loading_;
  Implant implant_;

  std::uint64_t tick_ = 0;
  std::uint32_t flags_ = 0;
  LandmarkSet landmarks_;  // of this tick
  std::array<std::uint64_t, 4> evaluation_counts_{};

  std::vector<float> rest_, deformed_;  // 3N
  std::vector<std::uint64_t> block_ticks_;
  std::vector<std::uint64_t> block_evaluated_;  // tick in which the block was last in reach
  std::vector<std::uint32_t> displaced_,
      was_displaced_;  // blocks not at rest now, and after the last evaluation
  /// Blocks that changed in each of the last ticks, ring by tick: what a slot a few publishes behind lacks.
  static constexpr std::size_t kChangeHistory = 8;
  std::array<std::vector<std::uint32_t>, kChangeHistory> changed_;
  double max_displacement_ = 0;
  std::uint32_t moved_vertices_ = 0;
  std::vector<NeedleState> needles_;
  std::vector<MeshState::PoseHistory> pose_histories_;
};

}  // namespace brachy
