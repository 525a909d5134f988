#pragma once

#include "core/base/rigid_transform.h"

namespace brachy {

/// How the gland moves as a whole on its ligaments.
struct GlandSettings {
  bool moves = false;
  /// Force that moves the whole gland by 1 mm along x, y and z. 6 to 8 N along the needle move it by about 10 mm; that
  /// it gives half as much across is an assumption.
  Vec3 stiffness_n_per_mm{1.4, 1.4, 0.7};
  /// Moment that turns it by 1° about its apex; an assumption: 5 N 15 mm beside the axis turn it by 7°. V. Lagerburg et
  /// al., Radiother. Oncol. 77 (2005) 318, saw up to 14°.
  double rotation_nmm_per_deg = 10;

  bool operator==(const GlandSettings&) const = default;
};

/// How the gland swells under the needles.
struct SwellingSettings {
  bool on = false;
  double build_up_s = 60;  ///< time constant with which it follows the punctures; an assumption

  /// Day-0 swelling left–right, antero-posterior and cranio-caudal.
  static inline const Vec3 kDayZero{1.01, 1.11, 1.08};
  /// In theatre: +2.5 cc after two fixation needles, +4.5 cc at the end, of 37 cc; of kDayZero's 21 % the share
  /// kTheatre (1 − e^{−punctures/kPunctures}).
  static constexpr double kTheatre = 0.577, kPunctures = 2.47;
  static constexpr double kResolvedDays = 30;  ///< it resolves linearly over

  /// Stretches of that share of the day-0 swelling.
  static Vec3 stretch(double share) { return Vec3::Ones() + share * (kDayZero - Vec3::Ones()); }

  bool operator==(const SwellingSettings&) const = default;
};

/// How the gland as a whole behaves.
struct BodySettings {
  GlandSettings gland;
  SwellingSettings swelling;
};

}  // namespace brachy
