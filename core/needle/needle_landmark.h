#pragma once

#include "core/base/rigid_transform.h"
#include "core/kernels/landmark_spread.h"

namespace brachy {

/// A material point that a needle or the probe displaces, and the outcome of a tick. Bounds and slip are along `axis`,
/// a needle's own or the probe's normal; across it the point follows a needle, and slides freely on the probe.
struct NeedleLandmark {
  Vec3 position = Vec3::Zero();  ///< rest, mm
  Vec3 axis = Vec3::UnitZ();     ///< unit
  bool slides = false;           ///< across it
  Vec3 if_stuck =
      Vec3::Zero();  ///< its displacement where it does not slip, mm; and the needle does not bend
  double low_n = 0, high_n = 0;  ///< bounds of the needle's force on it along the axis, N; forward is > 0
  double friction_n = 0;         ///< of both bounds, the shaft's part
  LandmarkSpread spread = {};    ///< of its force
  Vec3 relaxed_n =
      Vec3::Zero();   ///< of the reaction that the displacement would take at once, what has relaxed, N
  double arc_mm = 0;  ///< where on a flexible needle it is, from the hub
  Vec3 body = Vec3::Zero();        ///< of if_stuck, what the body's motion until now adds, mm
  Vec3 reaction_n = Vec3::Zero();  ///< outcome: the needle's force on the tissue, N
  double slip_mm = 0;              ///< outcome: how far the needle advanced past it
  double body_mm = 0;              ///< outcome: how far along the needle the body as a whole has gone there
};

}  // namespace brachy
