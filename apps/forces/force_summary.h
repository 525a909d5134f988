#pragma once

#include <cstdint>

#include "apps/forces/force_log.h"

namespace brachy {

/// The figures of one needle's force over a run, computed from its log alone. N, mm; NaN: not available.
class ForcePeaks {
 public:
  static constexpr double kNone = Certificate::kNotKnown;

  /// The needle's samples in order.
  void add(const ForceSample& sample);

  std::uint64_t samples() const { return samples_; }
  double out_n() const { return out_n_; }          ///< largest force that pushes the needle out, ≥ 0
  double in_n() const { return in_n_; }            ///< largest force that retains it on the way out, ≥ 0
  double lateral_n() const { return lateral_n_; }  ///< largest across the shaft
  double puncture_n() const {
    return puncture_n_;
  }  ///< largest force on a touching tip right before it was inside
  double depth_mm() const { return deepest_.depth_mm; }
  const ForceSample& deepest() const { return deepest_; }  ///< the first one at the largest depth
  double min_det() const { return min_det_; }
  double tip_deflection_mm() const { return tip_deflection_mm_; }  ///< largest

 private:
  std::uint64_t samples_ = 0;
  double out_n_ = 0, in_n_ = 0, lateral_n_ = 0, puncture_n_ = kNone, min_det_ = 1, tip_deflection_mm_ = 0;
  ForceSample deepest_, last_;
};

/// The work of one needle's forces over a run, by the trapezoid rule from tick to tick, N·mm.
class ForceWork {
 public:
  /// The needle's state after each tick in which it is present; `jumped`: it was reinitialized, no work was done.
  void add(const NeedleState& state, bool jumped);
  void leave() { has_last_ = false; }  ///< it is not present

  /// While the needle went forward along its shaft: ∫ axial_n dz, and of it what acted on the tip and along the shaft.
  double insertion_nmm() const { return cutting_nmm_ + friction_nmm_; }
  double cutting_nmm() const { return cutting_nmm_; }
  double friction_nmm() const { return friction_nmm_; }
  /// The total work of the hand, −∫ force·dp − ∫ torque·dθ: dissipated where the tissue is at rest in the end, else
  /// with what it still holds.
  double hand_nmm() const { return hand_nmm_; }

 private:
  bool has_last_ = false;
  RigidTransform X_WN_;
  NeedleForces forces_;
  double cutting_nmm_ = 0, friction_nmm_ = 0, hand_nmm_ = 0;
};

/// `part` of `whole`; NaN where `whole` is negligible.
double share_of(double part, double whole);

}  // namespace brachy
