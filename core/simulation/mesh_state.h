#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/seeds/seed_drop.h"
#include "core/brachytherapy/structures/organ_contact.h"
#include "core/injectivity/certificate.h"
#include "core/models/step_flag.h"
#include "core/needle/contact_state.h"
#include "core/needle/local_contact_model.h"
#include "core/needle/needle_forces.h"
#include "core/needle/needle_pose.h"

namespace brachy {

/// The pose the simulation used at one tick.
struct TickPose {
  std::uint64_t tick = 0;
  RigidTransform X_WN;
  bool button = false;
};

/// The course of a needle that bends, or that follows its plan's: points at equal arc lengths from the hub to the tip,
/// world frame W, mm.
struct NeedleShape {
  static constexpr std::size_t kPoints = 17;

  bool is_bent = false;  ///< false: the needle is rigid and straight, and its points are not set
  std::array<Vec3, kPoints> points = [] {
    std::array<Vec3, kPoints> zero;
    zero.fill(Vec3::Zero());
    return zero;
  }();
  Vec3 tip_axis = Vec3::UnitZ();       ///< unit, the tip's tangent
  Vec3 tip_deflection = Vec3::Zero();  ///< of the tip off where the pose puts it, mm

  /// Size of tip_deflection, 0 of a rigid needle.
  double tip_deflection_mm() const { return is_bent ? tip_deflection.norm() : 0; }
  bool is_finite() const {
    return tip_axis.allFinite() && tip_deflection.allFinite() &&
           std::ranges::all_of(points, [](const Vec3& p) { return p.allFinite(); });
  }
};

/// One needle as the simulation sees it after a tick.
struct NeedleState {
  bool present = false;
  NeedlePose input;  ///< the pose of this tick, with the stamps to echo
  ContactState contact = ContactState::kFree;
  RigidTransform X_WN;            ///< world frame W, mm
  double insertion_depth_mm = 0;  ///< length of the cut path from the entry to the tip, in the rest shape
  /// Distance of the tip along the needle from where it met the surface at rest, its push included, mm: what
  /// published forces are plotted against. 0 outside.
  double tip_depth_mm = 0;
  std::uint32_t landmark_count = 0;  ///< this needle's landmarks in this tick
  std::uint32_t puncture_count = 0;  ///< capsule punctures since start
  NeedleForces forces;
  LocalContactModel local_model;
  NeedleShape shape;
  DropCounts drops;
};

/// The tick in a few numbers. The simulator writes all of it except what the deformation loop sets.
struct TickSummary {
  std::uint64_t run = 0;   ///< counts the simulators: after a reset, or with another model (set by the loop)
  std::uint64_t tick = 0;  ///< 1 for the first step, 0 at rest before it
  double sim_time_s = 0;   ///< tick × period
  std::uint32_t step_flags = 0;      ///< StepFlag bits
  std::uint32_t landmark_count = 0;  ///< solved in this tick: all needles' and the anchors
  Certificate certificate;           ///< of this tick's field
  double max_displacement_mm = 0;
  /// By how much the points that are shown lag behind this tick's field, at most (Composition::lag_mm, an estimate): of
  /// blocks that are left to later ticks, and of the landmarks where the whole field is. NaN: not known, of a relay.
  double lag_mm = 0;
  std::uint32_t moved_vertices = 0;  ///< points displaced from rest in this tick
  std::uint64_t overruns = 0;        ///< deadlines missed since start (set by the loop)
  std::int64_t publish_ns = 0;       ///< monotonic clock at publish (set by the loop)
};

/// The tissue's points where the tick has put them.
///
/// Points are in tissue order: surface vertices first, then interior points. `block_ticks[b]` is the last tick in
/// which any coordinate of block b (Tissue::blocks) changed, 0 = still at rest: a reader that last saw tick T needs
/// exactly the blocks with block_ticks[b] > T, however many publishes it skipped.
struct DeformedMesh {
  std::vector<float> deformed_vertices;  ///< 3N: x0 y0 z0 x1 …, world frame, mm
  std::vector<std::uint64_t> block_ticks;
};

/// The seeds in the tissue, in the order of their drops: the first `count` slots. The rest is spare, so that a drop
/// does not allocate.
struct SeedStates {
  std::span<const Seed> in_tissue() const { return {slots.data(), count}; }

  std::vector<Seed> slots;           ///< seeds.max_count of them in a Simulator's state
  std::vector<std::uint64_t> ticks;  ///< of each slot: to a seed what block_ticks is to a block
  std::uint32_t count = 0;
};

/// Seeds that were asked for and are not in the body, the last kKept of them: ring indexed by their number.
struct FailedDrops {
  static constexpr std::size_t kKept = 128;

  std::uint64_t count = 0;  ///< since the start; number i is in slots[i % kKept]
  std::array<FailedDrop, kKept> slots;
};

/// The scene's needles, by id.
struct NeedleStates {
  static constexpr std::size_t kPoseHistory = 128;
  using PoseHistory = std::array<TickPose, kPoseHistory>;

  std::vector<NeedleState> states;
  /// Each needle's poses of the last ticks, ring indexed by tick % kPoseHistory: a recorder at 30 Hz still gets
  /// every one. An entry with another tick has no pose: there was no needle then.
  std::vector<PoseHistory> pose_histories;
  /// Of needle n and SimulationModel::organs[k] at n × organs + k; the probe has none.
  std::vector<OrganContact> organ_contacts;
};

/// Everything one tick produced: one slot of the triple buffer, and the body of a snapshot.
///
/// Simulator::initial_state gives every vector its size, and Simulator::step brings the slot up to date without
/// allocating. Readers: FRAME and OpenIGTLink, the log and telemetry, recordings, the state's hash.
/// Threads: a plain value. Whoever holds the slot writes or reads it; nobody else does meanwhile.
struct MeshState {
  TickSummary summary;
  DeformedMesh mesh;
  SeedStates seeds;
  FailedDrops failed_drops;
  NeedleStates needles;
};

}  // namespace brachy
