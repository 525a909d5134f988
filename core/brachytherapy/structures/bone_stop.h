#pragma once

#include <vector>

#include "core/base/rigid_transform.h"
#include "core/brachytherapy/structures/tested_organs.h"
#include "core/needle/local_contact_model.h"
#include "core/needle/needle_forces.h"

namespace brachy {

/// Bone stops a needle: its tip stays at the bone's surface however far the hand goes on, and a stiff spring along the
/// shaft pushes the hand back,
///
///     F = k δ,   δ: how far the hand's tip is beyond the held one, at most kLargestN,
///
/// which rises to what the device can take within a millimetre or two (ForceGate scales it). The needle that everything
/// else sees is the held one, a rigid body as before: the contact solve and its guarantees do not know of bone.
/// Sidewise the tip slides along the bone without friction.
/// Limits: only the tip is stopped; a shaft that is moved sidewise goes through bone, and OrganContacts reports it.
/// Threads: one. Real-time: no allocation; some BVH queries a call.
class BoneStop {
 public:
  static constexpr double kLargestN = 100;      ///< more than a hand pushes; keeps numbers finite
  static constexpr double kClearanceMm = 1e-3;  ///< the held tip is so far outside

  /// `organs` must outlive this; those that are bone count.
  BoneStop(const std::vector<TestedOrgan>& organs, double stiffness_n_per_mm, double length_mm,
           double max_jump_mm);

  /// The hand's pose, held where it would bring the tip into bone. `bend`: of the tip off the pose, mm. A pose that
  /// jumps is held if its tip is in bone.
  RigidTransform hold(RigidTransform X_WN, const Vec3& bend) noexcept;
  void skip() noexcept;  ///< a tick without a needle

  bool is_stopped() const { return held_back_mm_ > 0; }
  double force_n() const noexcept;
  /// Adds the bone's part to a tick's force and to the model that a device computes it from; none: nothing.
  void add_to(NeedleForces& forces, LocalContactModel& model) const noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(is_known_, last_tip_, axis_, last_hand_tip_, held_back_mm_);
  }

 private:
  const std::vector<TestedOrgan>& organs_;
  double stiffness_, length_, max_jump_;
  bool has_bone_;
  bool is_known_ = false;
  Vec3 last_tip_ = Vec3::Zero(), axis_ = Vec3::UnitZ();  // held
  Vec3 last_hand_tip_ = Vec3::Zero();
  double held_back_mm_ = 0;
};

}  // namespace brachy
