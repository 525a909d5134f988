#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/brachytherapy/seeds/implant.h"
#include "core/brachytherapy/seeds/seed_loading.h"
#include "core/brachytherapy/structures/bone_stop.h"
#include "core/brachytherapy/structures/organ_contacts.h"
#include "core/models/guard/guarded_field.h"
#include "core/needle/contact_solve.h"
#include "core/needle/needle_contact.h"
#include "core/needle/needle_order.h"
#include "core/simulation/body_motion.h"
#include "core/simulation/mesh_state.h"
#include "core/simulation/simulation_model.h"
#include "core/solve/anchors.h"

namespace brachy {

/// The simulation: poses → contact → landmarks → stick and slip → field → seeds → mesh state, one tick a call.
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

  /// Puts the seeds of an earlier run, in the order of their drops, into the tissue and removes them from their
  /// needles. Call it before initial_state and the first step. Throws UserError where they are more than
  /// seeds.max_count.
  void restore_seeds(std::span<const Seed> seeds);
  /// The same for seeds that an earlier run lost: indices in Plan::seeds.
  void restore_lost(std::span<const std::int32_t> planned);

  /// Another plan to load needles from (SeedLoading::set_plan), from the next step on. Real-time: as step.
  void set_plan(const LoadingPlan& plan) noexcept { seed_loading_.set_plan(plan); }

  /// Continues from `other`, which has the same scene with another model: with its time, its seeds and the seeds left
  /// in its needles. The tissue is at rest, and needles in it are reinserted. Before the first step.
  /// Real-time: as step.
  void resume_from(const Simulator& other) noexcept;

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
  const Tissue& tissue() const { return tissue_; }
  SimdTarget simd_target() const { return model_->settings.target; }
  /// Ticks evaluated in each way since construction, indexed by Evaluation.
  const std::array<std::uint64_t, 4>& evaluation_counts() const { return evaluation_counts_; }
  double period_s() const { return period_s_; }
  /// The displacement field of the last step, in the frame of the body, and where the body is: a material point X is at
  /// body_frame().to_world(X + u(X)). Its certificate is the summary's. Valid until the next step.
  DisplacementField& field() { return *field_; }
  const BodyFrame& body_frame() const { return body_.frame(); }
  /// The landmarks that make it, in the frame of the body. Where the summary has kStepSolveFailed the field is that of
  /// an earlier tick.
  const LandmarkSet& landmarks() const { return landmarks_; }

 private:
  void begin_contacts(std::span<const NeedlePose> poses) noexcept;
  void hold_contacts(std::span<const NeedlePose> poses) noexcept;
  void begin_probe(const NeedlePose& pose) noexcept;
  void gather_landmarks() noexcept;
  void add_needle(std::size_t n, bool tip) noexcept;
  void add_probe() noexcept;
  void add_landmark(NeedleLandmark& landmark, const LandmarkSpread& spread, LandmarkSet::Owner owner,
                    std::int32_t beam) noexcept;
  bool keep_clear(Vec3& anchor) const noexcept;
  bool solve_contacts() noexcept;
  bool is_over_budget() const noexcept;
  void deform() noexcept;
  void apply_field() noexcept;
  void apply_everywhere() noexcept;
  bool apply_block(std::uint32_t b) noexcept;
  void find_shapes() noexcept;
  void drop_seeds() noexcept;
  void drop(std::size_t needle, const SeedDrop& due) noexcept;
  bool is_in_tissue(std::size_t needle) const noexcept;
  void refuse_drop(std::size_t needle, DropRefusal why, const Vec3& at,
                   std::int32_t planned = FailedDrop::kNotPlanned) noexcept;
  void test_organs() noexcept;
  Vec3 mean_displacement() const noexcept;
  void write_state(MeshState& state) noexcept;

  std::shared_ptr<const SimulationModel> model_;
  const Tissue& tissue_;  // the model's
  double period_s_;
  std::vector<NeedleContact> contacts_;  // by needle
  std::vector<BoneStop> bone_stops_;     // by needle
  std::vector<OrganContacts> organ_contacts_;
  std::optional<ProbeContact> probe_;  // the instrument after them
  ContactSolve contact_solve_;
  ClinicalNoise noise_;
  BodyMotion body_;
  BodyFrame shown_frame_;  // in which deformed_ is
  Anchors anchors_;
  double anchor_clearance_;
  std::unique_ptr<GuardedField> field_;
  SeedLoading seed_loading_;
  Implant implant_;

  std::uint64_t tick_ = 0;
  std::uint32_t flags_ = 0;
  LandmarkSet landmarks_;      // of this tick, or of the one before it, whose field is due
  bool is_field_due_ = false;  // the last tick had no time for the field of its landmarks
  NeedleOrder needle_order_;
  std::vector<std::int32_t> last_on_shaft_;  // of each needle, its landmark behind the tip; −1: none
  std::vector<std::int32_t> beams_;  // of each needle, in landmarks_.compliance; −1: it does not bend
  std::array<std::uint64_t, 4> evaluation_counts_{};

  std::vector<float> rest_, deformed_;  // 3N
  std::vector<std::uint64_t> block_ticks_;
  std::vector<std::uint64_t> block_evaluated_;  // tick in which the block was last in reach
  std::vector<std::uint32_t> displaced_,
      was_displaced_;  // blocks not at rest now, and after the last evaluation
  /// Blocks that changed in each of the last ticks, ring by tick: what a slot that is a few publishes behind has to
  /// catch up on.
  static constexpr std::size_t kChangeHistory = 8;
  std::array<std::vector<std::uint32_t>, kChangeHistory> changed_;
  double max_displacement_ = 0;
  std::uint32_t moved_vertices_ = 0;
  std::vector<NeedleState> needles_;
  std::vector<OrganContact> organ_states_;  // as NeedleStates::organ_contacts
  FailedDrops failed_drops_;
  std::vector<NeedleStates::PoseHistory> pose_histories_;
};

}  // namespace brachy
