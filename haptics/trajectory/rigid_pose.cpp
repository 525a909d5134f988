#include "haptics/trajectory/rigid_pose.h"

#include <cassert>
#include <Eigen/LU>

namespace brachy {

PoseDefect find_defect(const RigidTransform& X) {
  if (!X.R.allFinite() || !X.p.allFinite()) return PoseDefect::kNotFinite;
  if (X.p.cwiseAbs().maxCoeff() > kMaxTipOffset) return PoseDefect::kOutOfRange;
  // First the entries: huge ones would overflow to NaN in RᵀR, and no comparison holds for NaN.
  if (X.R.cwiseAbs().maxCoeff() > 1 + kRigidTolerance) return PoseDefect::kNotRigid;
  if (rigidity_error(X) > kRigidTolerance) return PoseDefect::kNotRigid;
  return PoseDefect::kNone;
}

void make_rigid(RigidTransform& X) {
  assert(rigidity_error(X) <= kRigidTolerance);
  if (rigidity_error(X) <= kExactRotation) return;
  // Newton's iteration for the orthogonal polar factor, the nearest rotation in the Frobenius norm (Higham
  // 1986): the error is squared each time, 1e-3, 1e-7, 1e-14.
  for (int i = 0; i < 4; ++i) X.R = (0.5 * (X.R + X.R.inverse().transpose())).eval();
}

}  // namespace brachy
