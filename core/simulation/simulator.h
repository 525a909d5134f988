#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/models/guard/guarded_field.h"
#include "core/needle/contact_solve.h"
#include "core/simulation/body_motion.h"
#include "core/simulation/instruments.h"
#include "core/simulation/mesh_state.h"
#include "core/simulation/organ_tests.h"
#include "core/simulation/seed_drops.h"
#include "core/simulation/shown_mesh.h"
#include "core/simulation/simulation_model.h"
#include "core/simulation/tick_landmarks.h"

namespace brachy {

/// The simulation, one tick a call: poses → contact → landmarks → stick and slip → field → mesh, seeds and organs.
///
/// A step depends on its arguments and on the simulator's state: the needles' contact, the anchors' λ and the last
/// field. Every tick's field is computed from the rest shape. The same poses give the same states, bit for bit, on
/// every run and for any number of threads.
/// Threads: one caller (OpenMP inside, if the scene asks). Real-time: step does not allocate, lock, throw or read a
/// clock.
class Simulator {
 public:
  /// Several simulators may share `model`, on one thread or on several; its tables are not made again.
  /// Not real-time (make_guarded_field).
  explicit Simulator(std::shared_ptr<const SimulationModel> model);
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  /// As SeedDrops::restore and restore_lost. Call them before initial_state and the first step.
  void restore_seeds(std::span<const Seed> seeds) { seeds_.restore(seeds); }
  void restore_lost(std::span<const std::int32_t> planned) { seeds_.restore_lost(planned); }

  /// Another plan to load needles from (SeedLoading::set_plan), from the next step on. Real-time: as step.
  void set_plan(const LoadingPlan& plan) noexcept { seeds_.set_plan(plan); }

  /// Continues from `other`, which has the same scene with another model: with its time, its seeds and the seeds left
  /// in its needles. The tissue is at rest, and needles in it are reinserted. Before the first step.
  /// Real-time: as step.
  void resume_from(const Simulator& other) noexcept;

  /// The whole state after a step, from which a simulator of the same model goes on bit for bit: with `restore`, then a
  /// slot of initial_state. Bytes are this machine's, some 0.6 MB for 14,560 points. Real-time within the capacity of
  /// `bytes`.
  void save(std::vector<std::byte>& bytes) const;
  /// Errors: UserError where `state` is not whole, or of another scene or version; this is then of no more use.
  void restore(std::span<const std::byte> state);

  /// The tissue at rest, tick 0: the initial content of every slot that step gets.
  MeshState initial_state() const;

  /// One tick with the needles at `poses`, by id (not present, or fewer than the scene has: no needle); the probe,
  /// where the scene has one, comes after the needles, and so does its state. `state` is
  /// a slot that only this simulator has written since initial_state, however many ticks ago: blocks that have
  /// changed since are brought up to date.
  void step(std::span<const NeedlePose> poses, MeshState& state) noexcept;
  /// The same for a scene of one needle.
  void step(const NeedlePose& pose, MeshState& state) noexcept { step(std::span(&pose, 1), state); }

  const std::shared_ptr<const SimulationModel>& model() const { return model_; }
  const Tissue& tissue() const { return model_->tissue; }
  SimdTarget simd_target() const { return model_->settings.target; }
  /// Ticks evaluated in each way since construction, indexed by Evaluation.
  const std::array<std::uint64_t, 4>& evaluation_counts() const { return evaluation_counts_; }
  double period_s() const { return model_->settings.period_s; }
  /// The contacts of the needles after the last step, by id.
  std::span<const NeedleContact> needles() const { return instruments_.needles(); }
  /// The displacement field of the last step, in the frame of the body, and where the body is: a material point X is at
  /// body_frame().to_world(X + u(X)). Its certificate is the summary's. Valid until the next step.
  DisplacementField& field() { return *field_; }
  const BodyFrame& body_frame() const { return body_.frame(); }
  /// The landmarks that make it, in the frame of the body. Where the summary has kStepSolveFailed the field is that of
  /// an earlier tick.
  const LandmarkSet& landmarks() const { return landmarks_.set(); }

  /// For StateWriter and StateReader (core/base/state_archive.h): all but the field, which `save` adds.
  template <class Archive>
  void list_state(Archive& archive) {
    archive(tick_, flags_, is_field_due_, evaluation_counts_, instruments_, landmarks_, contact_solve_, body_,
            mesh_, seeds_, organs_);
  }

 private:
  bool solve_contacts() noexcept;
  bool is_over_budget() const noexcept;
  double lag_mm() const noexcept;
  void deform() noexcept;
  void write(MeshState& state) noexcept;

  std::shared_ptr<const SimulationModel> model_;
  std::unique_ptr<GuardedField> field_;
  Instruments instruments_;
  TickLandmarks landmarks_;  // of this tick, or of the one before it, whose field is due
  ContactSolve contact_solve_;
  BodyMotion body_;
  ShownMesh mesh_;
  SeedDrops seeds_;
  OrganTests organs_;

  std::uint64_t tick_ = 0;
  std::uint32_t flags_ = 0;
  bool is_field_due_ = false;  // the last tick had no time for the field of its landmarks
  std::array<std::uint64_t, 4> evaluation_counts_{};
};

}  // namespace brachy
