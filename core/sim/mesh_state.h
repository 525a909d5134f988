#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "core/contact/local_contact_model.h"
#include "core/contact/needle_forces.h"
#include "core/seeds/seed.h"
#include "core/seeds/seed_drop.h"
#include "core/sim/needle_pose.h"
#include "core/stability/certificate.h"

namespace brachy {

/// Where the needle stands to the tissue (DESIGN §5). Values go over the wire: append only.
enum class ContactState : std::uint8_t {
  kFree = 0,       ///< never touched since the last reset
  kTouching = 1,   ///< pressing on the intact capsule: one landmark
  kInserted = 2,   ///< the tip is inside: landmarks along the cut path
  kThrough = 3,    ///< the tip has left through the far side, the shaft is still inside
  kWithdrawn = 4,  ///< has been in and is out again; the tissue is at rest
};

/// The state's name as it stands in logs, events and reports.
constexpr std::string_view to_string(ContactState state) {
  switch (state) {
    case ContactState::kFree:
      return "free";
    case ContactState::kTouching:
      return "touching";
    case ContactState::kInserted:
      return "inserted";
    case ContactState::kThrough:
      return "through";
    case ContactState::kWithdrawn:
      return "withdrawn";
  }
  return "unknown";
}

/// What a step could not do as asked; bits of MeshState::step_flags. Go over the wire: append only.
enum StepFlag : std::uint32_t {
  kStepSolveFailed = 1u << 0,  ///< landmark system not positive definite: the last good field is kept
  kStepSaturated = 1u << 1,    ///< a landmark's displacement was held at contact.max_displacement_mm
  kStepReseated = 1u << 2,     ///< the needle jumped: it was taken out and put in anew without deformation
  kStepFolded = 1u << 3,       ///< the field folds (Certificate::place)
  kStepUncertified = 1u << 4,  ///< whether the field folds is not known
  kStepSubstepped = 1u << 5,   ///< sub-steps were composed (Certificate::substeps)
  kStepClamped = 1u << 6,      ///< landmarks were held at the last injective position (Certificate::held_mm)
  kStepMerged = 1u << 7,       ///< landmarks that say the same at the same place were made one
  kStepDropped = 1u << 8,      ///< landmarks were left out: contradictory, or too close for a stable solve
  kStepSlipUnsettled = 1u << 9,  ///< stick and slip did not converge: a reaction may be out of its bounds
};

/// The pose the simulation used at one tick.
struct TickPose {
  std::uint64_t tick = 0;
  RigidTransform X_WN;
  bool button = false;
};

/// One needle as the simulation sees it after a tick.
struct NeedleState {
  bool present = false;
  NeedlePose input;  ///< the pose this tick used, with the stamps to echo
  ContactState contact = ContactState::kFree;
  RigidTransform X_WN;            ///< world frame W, mm
  double insertion_depth_mm = 0;  ///< length of the cut path from the entry to the tip, in the rest shape
  /// How far the tip itself has come along the needle since it met the surface at rest, its push included, mm: what
  /// published forces are drawn against. 0 outside.
  double tip_depth_mm = 0;
  std::uint32_t landmark_count = 0;  ///< this needle's landmarks in this tick
  std::uint32_t puncture_count = 0;  ///< capsule punctures since start
  NeedleForces forces;
  LocalContactModel local_model;
  DropCounts drops;
};

/// Everything one tick produced: one slot of the triple buffer, and the body of a snapshot.
///
/// Points are in tissue order: surface vertices first, then interior points. `block_ticks[b]` is the last tick in
/// which any coordinate of block b (TissueBlocks) changed, 0 = still at rest: a reader that last saw tick T needs
/// exactly the blocks with block_ticks[b] > T, however many publishes it skipped.
struct MeshState {
  static constexpr std::size_t kPoseHistory = 128;
  using PoseHistory = std::array<TickPose, kPoseHistory>;

  std::uint64_t run = 0;             ///< counts the simulators: anew, or with another model (set by the loop)
  std::uint64_t tick = 0;            ///< 1 for the first step
  double sim_time_s = 0;             ///< tick × period
  std::vector<NeedleState> needles;  ///< as many as the scene has, by id
  std::uint32_t step_flags = 0;      ///< StepFlag bits
  std::uint32_t landmark_count = 0;  ///< solved in this tick: all needles' and the anchors
  Certificate certificate;           ///< of this tick's field
  double max_displacement_mm = 0;
  std::uint32_t moved_vertices = 0;      ///< points displaced from rest in this tick
  std::vector<float> deformed_vertices;  ///< 3N: x0 y0 z0 x1 …, world frame, mm
  std::vector<std::uint64_t> block_ticks;
  /// Each needle's poses of the last ticks, ring indexed by tick % kPoseHistory: a recorder at 30 Hz still gets every one.
  /// An entry whose tick is another is of no pose: there was no needle then.
  std::vector<PoseHistory> pose_histories;
  /// Seeds in the tissue in the order of falling, seed_count of them; the rest is room. seed_ticks[i] is to seed i what
  /// block_ticks is to a block.
  std::vector<Seed> seed_slots;
  std::vector<std::uint64_t> seed_ticks;
  std::uint32_t seed_count = 0;
  std::span<const Seed> seeds() const { return {seed_slots.data(), seed_count}; }

  std::uint64_t overruns = 0;   ///< deadlines missed since start (set by the loop)
  std::int64_t publish_ns = 0;  ///< monotonic clock at publish (set by the loop)
};

}  // namespace brachy
