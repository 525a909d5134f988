#pragma once

#include <algorithm>
#include <cmath>

#include "core/needle/local_contact_model.h"

namespace brachy {

/// No place, stiffness or force of a simulation is beyond these, mm, N/mm and N: within them no product overflows.
inline constexpr double kFarthestMm = 1e6, kStiffestNPerMm = 1e6, kLargestLateralN = 1e6;
/// A model's time to live is cut to this, s.
inline constexpr double kLongestTimeToLiveS = 5;

/// Whether a place is finite and near enough to calculate with.
inline bool is_place(const Vec3& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() <= kFarthestMm;
}

/// Whether an untrusted model can be used: finite except for its bounds, which may be infinite, and within the limits
/// above, the axis a unit vector, stiffnesses ≥ 0, min ≤ 0 ≤ max.
inline bool is_usable(const LocalContactModel& m) {
  const bool bounded = is_place(m.reference_tip) && is_place(m.contact_point) && m.axis.allFinite() &&
                       m.lateral_n.allFinite() && m.lateral_n.cwiseAbs().maxCoeff() <= kLargestLateralN &&
                       m.axial_stiffness_n_per_mm <= kStiffestNPerMm &&
                       m.lateral_stiffness_n_per_mm <= kStiffestNPerMm && std::isfinite(m.time_to_live_s);
  return bounded && std::abs(m.axis.squaredNorm() - 1) < 1e-6 && m.axial_stiffness_n_per_mm >= 0 &&
         m.lateral_stiffness_n_per_mm >= 0 && m.axial_min_n <= 0 && m.axial_max_n >= 0 &&
         m.after_puncture_n >= 0;
}

/// Whether the contact only pushes: a capsule met from outside. A capsule met from within another tissue also
/// has that tissue's friction (axial_min_n < 0).
inline bool only_pushes(const LocalContactModel& m) {
  return m.is_capsule && m.axial_min_n == 0;
}

/// The same contact with `gain` (0 … 1) times the force at every tip: stiffnesses and forces scaled, slip
/// unchanged.
inline LocalContactModel scaled(LocalContactModel m, double gain) {
  const auto bound = [gain](double n) { return gain > 0 ? gain * n : 0; };  // which may be infinite
  m.axial_stiffness_n_per_mm *= gain;
  m.axial_min_n = bound(m.axial_min_n);
  m.axial_max_n = bound(m.axial_max_n);
  m.after_puncture_n = bound(m.after_puncture_n);
  m.lateral_n *= gain;
  m.lateral_stiffness_n_per_mm *= gain;
  return m;
}

/// Limits the stiffness of one needle's successive models. Across the shaft the whole spring is weakened,
/// force and stiffness. Along the shaft only the stiffness: the tissue slips at the same force as before, but
/// after a longer displacement. The contact point of slipping tissue is then kept by this class and dragged
/// along at slip force over limited stiffness; with the simulation's contact point, which belongs to the
/// stiffer tissue, the slip force would never be reached. If the force itself jumped to the simulation's at
/// each model, the loop would be closed over the network at full stiffness, which the limit is there to
/// prevent.
///
/// Threads: one. Real-time: O(1), no allocation, lock or exception.
class StiffnessLimiter {
 public:
  /// `limit` in N/mm, > 0. Returns whether the model, which is usable, had to be changed.
  bool apply(LocalContactModel& m, double limit) noexcept {
    const bool lateral = m.lateral_stiffness_n_per_mm > limit, axial = m.axial_stiffness_n_per_mm > limit;
    if (lateral) {
      m.lateral_n *= limit / m.lateral_stiffness_n_per_mm;
      m.lateral_stiffness_n_per_mm = limit;
    }
    if (axial) m.axial_stiffness_n_per_mm = limit;
    // The contact point of a capsule that is only pushed is the simulation's.
    if (axial && m.in_contact && !only_pushes(m)) {
      if (dragging_) {
        const double z = (m.reference_tip - contact_point_).dot(m.axis);
        const double kept = std::clamp(z, m.axial_min_n / limit, m.axial_max_n / limit);
        m.contact_point = m.reference_tip - kept * m.axis;
      }
      contact_point_ = m.contact_point;
      dragging_ = true;
    } else {
      dragging_ = false;
    }
    return axial || lateral;
  }

 private:
  bool dragging_ = false;
  Vec3 contact_point_ = Vec3::Zero();  // of the last model, if it was limited
};

}  // namespace brachy
