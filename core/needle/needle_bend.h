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
/// Threads: one. Real-time: no allocation after construction.
class NeedleBend {
 public:
  /// Slopes beyond which the beam's small angles no longer do (kStepSteep).
  static constexpr double kSteepest = 0.1405;  // tan 8°

  /// `guide_z_mm`: world z of the template's plane, whose hole holds the needle; none: nothing does.
  NeedleBend(const NeedleSettings& needle, std::optional<double> guide_z_mm, std::size_t max_landmarks);

  /// Starts a tick with the needle's pose in the body's frame, in which all vectors are; and in the world's, in which
  /// the template stands.
  void begin(const RigidTransform& X_BN, const RigidTransform& X_WN) noexcept;
  /// This tick's force at the tip, N, across the needle: of the bevel as it cuts.
  void set_tip_force(const Vec3& force_n) noexcept { tip_force_n_ = across(force_n); }
  /// The pose's direction in which the bevel pushes the tip; unit, or 0 for a symmetric tip.
  const Vec3& bevel_direction() const { return bevel_direction_; }
  /// Where the needle would be at arc length s by the tip's force alone, off its line, mm.
  Vec3 free_deflection(double s) const { return beam_.compliance(s, beam_.length_mm) * tip_force_n_; }
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
  /// What the template's hole does to the needle, N.
  Vec3 guide_force_n() const noexcept;

 private:
  struct Load {
    double arc_mm = 0;
    Vec3 force_n = Vec3::Zero();  // on the needle, across it
  };
  Vec3 across(const Vec3& v) const { return v - v.dot(beam_.axis) * beam_.axis; }

  Beam beam_;
  std::optional<double> guide_z_;
  Vec3 tip_ = Vec3::Zero();
  double bevel_cos_ = 0, bevel_sin_ = 0;
  Vec3 bevel_direction_ = Vec3::Zero(), tip_force_n_ = Vec3::Zero();
  std::vector<Load> loads_;
};

}  // namespace brachy
