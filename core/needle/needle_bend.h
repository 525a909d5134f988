#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/elasticity/beam.h"
#include "core/needle/contact_settings.h"
#include "core/needle/needle_landmark.h"

namespace brachy {

/// How a flexible needle bends: its beam, the forces across it and the shape that follows (core/DESIGN.md, section 5).
/// Until a tick's forces are known the shape is that of the last ones on the needle where it is now.
///
/// The hand holds the hub on the line of the pose. Where the needle passes the template's plane, a hole holds it
/// across. A fixed hole (`guide_at = "template"`) stays in the world where the needle first passed the plane, so that a
/// hand that moves aside bends the needle and is pushed back. A hole that goes with the hand ("hand") stays on the line
/// of the pose; the hand carries it, and feels what it takes. Both slide along the needle without friction.
/// Threads: one. Real-time: no allocation after construction.
class NeedleBend {
 public:
  /// Slopes beyond which the beam's small angles no longer do (kStepSteep).
  static constexpr double kSteepest = 0.1405;  // tan 8°

  /// `guide_z_mm`: world z of the template's plane, whose hole holds the needle as needle.guide_at says; none: nothing
  /// does.
  NeedleBend(const NeedleSettings& needle, std::optional<double> guide_z_mm, std::size_t max_landmarks);

  /// Forgets the fixed hole: the needle has jumped.
  void leave_hole() noexcept { hole_.reset(); }
  /// Starts a tick with the needle's pose in the body's frame, in which all vectors are; and in the world's, in which
  /// the template stands.
  void begin(const RigidTransform& X_BN, const RigidTransform& X_WN) noexcept;
  /// This tick's force at the tip, N, across the needle: of the bevel as it cuts.
  void set_tip_force(const Vec3& force_n) noexcept { tip_force_n_ = across(force_n); }
  /// The pose's direction in which the bevel pushes the tip; unit, or 0 for a symmetric tip.
  const Vec3& bevel_direction() const { return bevel_direction_; }
  /// Where the needle would be at arc length s by the tip's force and the hole alone, off its line, mm.
  Vec3 free_deflection(double s) const {
    const Vec3 by_tip = beam_.compliance(s, beam_.length_mm) * tip_force_n_;
    return is_held_aside() ? Vec3(by_tip + beam_.guide_share(s) * offset_) : by_tip;
  }
  Vec3 free_tip_slope() const { return beam_.guide_slope(beam_.length_mm) * offset_; }  ///< by the hole alone
  /// Whether a fixed hole holds the needle off the line of the pose.
  bool is_held_aside() const { return is_held_by_template() && offset_ != Vec3::Zero(); }
  /// Takes the landmarks' reactions of this tick.
  void set_loads(std::span<const NeedleLandmark> landmarks) noexcept;
  void clear() noexcept;  ///< no force acts on the needle

  const Beam& beam() const { return beam_; }
  /// Arc length from the hub at which the needle passes x, mm.
  double arc_of(const Vec3& x) const noexcept;
  Vec3 deflection(double s) const noexcept;  ///< off the line of the pose at arc length s, mm
  Vec3 slope(double s) const noexcept;       ///< its derivative along the needle
  Vec3 tip_deflection() const noexcept { return deflection(beam_.length_mm); }
  Vec3 tip_slope() const noexcept { return slope(beam_.length_mm); }
  bool is_steep() const noexcept;  ///< somewhere steeper than kSteepest
  const Vec3& tip_force_n() const { return tip_force_n_; }
  /// Whether a hole holds the needle, and whether that hole is fixed in the world.
  bool is_guided() const { return beam_.guide_mm > 0; }
  bool is_held_by_template() const { return is_guided() && !goes_with_hand_; }
  /// What the hand feels of the hole, N: the hole's force on the needle, along it too where the bent needle slants in
  /// the hole. Of a hole that goes with the hand only what is along the needle: the rest is between hand and hand.
  Vec3 guide_force_n() const noexcept;
  /// Where that force acts, from the tip, mm.
  Vec3 guide_place() const { return (beam_.guide_mm - beam_.length_mm) * beam_.axis + offset_; }
  /// Of the hand's motion across the needle, what a landmark at arc length s takes part in: all of it without a fixed
  /// hole; less, and beyond the hole the contrary, with one.
  double share_of_hand(double s) const { return is_held_by_template() ? 1 - beam_.guide_share(s) : 1; }
  /// What the needle itself takes of each mm that the hand moves across it, N/mm: bent at a fixed hole.
  double stiffness_at_hole() const {
    return is_held_by_template() ? 1 / beam_.unguided(beam_.guide_mm, beam_.guide_mm) : 0;
  }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(beam_, hole_, offset_, tip_, bevel_direction_, tip_force_n_, loads_);
  }

 private:
  struct Load {
    double arc_mm = 0;
    Vec3 force_n = Vec3::Zero();  // on the needle, across it

    template <class Archive>
    void list_state(Archive& archive) {
      archive(arc_mm, force_n);
    }
  };
  Vec3 across(const Vec3& v) const { return v - v.dot(beam_.axis) * beam_.axis; }
  void find_hole(const RigidTransform& X_BN, const RigidTransform& X_WN) noexcept;

  Beam beam_;
  std::optional<double> guide_z_;
  bool goes_with_hand_;
  std::optional<Vec3> hole_;    // fixed, in the world
  Vec3 offset_ = Vec3::Zero();  // of the hole from the line of the pose, across it
  Vec3 tip_ = Vec3::Zero();
  double bevel_cos_ = 0, bevel_sin_ = 0;
  Vec3 bevel_direction_ = Vec3::Zero(), tip_force_n_ = Vec3::Zero();
  std::vector<Load> loads_;
};

}  // namespace brachy
