#include "apps/forces/force_summary.h"

#include <algorithm>
#include <cmath>

namespace brachy {
namespace {

/// The rotation from A to B as a vector in the world, rad; small ones.
Vec3 turn(const Mat3& R_WA, const Mat3& R_WB) {
  const Eigen::AngleAxisd turn(Mat3(R_WB * R_WA.transpose()));
  return turn.angle() * turn.axis();
}

}  // namespace

void ForcePeaks::add(const ForceSample& sample) {
  const NeedleForces& forces = sample.forces;
  out_n_ = std::max(out_n_, forces.axial_n);
  in_n_ = std::max(in_n_, -forces.axial_n);
  lateral_n_ = std::max(lateral_n_, forces.lateral_n);
  min_det_ = std::min(min_det_, sample.min_det);
  tip_deflection_mm_ = std::max(tip_deflection_mm_, sample.tip_deflection_mm);
  if (last_.state == ContactState::kTouching && sample.state == ContactState::kInserted)
    puncture_n_ = std::fmax(puncture_n_, last_.forces.cutting_n);
  if (samples_ == 0 || sample.depth_mm > deepest_.depth_mm) deepest_ = sample;
  last_ = sample;
  ++samples_;
}

void ForceWork::add(const NeedleState& state, bool jumped) {
  if (has_last_ && !jumped) {
    const Vec3 dp = state.X_WN.p - X_WN_.p;
    const double dz = dp.dot(state.X_WN.R.col(2));
    if (dz > 0) {
      cutting_nmm_ += 0.5 * (forces_.cutting_n + state.forces.cutting_n) * dz;
      friction_nmm_ += 0.5 * (forces_.friction_n + state.forces.friction_n) * dz;
    }
    hand_nmm_ -=
        0.5 * (forces_.force_n + state.forces.force_n).dot(dp) +
        0.5 * (forces_.tip_torque_nmm + state.forces.tip_torque_nmm).dot(turn(X_WN_.R, state.X_WN.R));
  }
  has_last_ = true;
  X_WN_ = state.X_WN;
  forces_ = state.forces;
}

double share_of(double part, double whole) {
  return std::abs(whole) > 1e-12 ? part / whole : ForcePeaks::kNone;
}

}  // namespace brachy
