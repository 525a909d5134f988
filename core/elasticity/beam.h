#pragma once

#include <algorithm>
#include <numbers>

#include "core/base/rigid_transform.h"

namespace brachy {

/// A needle as an Euler–Bernoulli beam along `axis`, clamped at the hand. It gives across the axis only. Arc lengths
/// from the hub in mm, forces in N. Slopes are taken as small: at 5° a nonlinear rod differs by 0.4 %.
/// Real-time: a plain value.
struct Beam {
  Vec3 axis = Vec3::UnitZ();  ///< unit, from the hub to the tip
  double length_mm = 0;
  double bending_stiffness_nmm2 = 0;  ///< EI, > 0; infinite: rigid
  /// how far a moment at the hub turns the hand, rad/(N·mm); 0: it holds the hub fast
  double hand_rad_per_nmm = 0;
  double guide_mm = 0;  ///< where a hole of the template holds the needle, from the hub; 0: nowhere

  /// Of a tube, or a rod where `inner_diameter_mm` is 0: E π (D⁴ − d⁴)/64, N·mm².
  static double bending_stiffness(double youngs_modulus_gpa, double diameter_mm, double inner_diameter_mm) {
    const auto fourth = [](double d) { return d * d * d * d; };
    return 1e3 * youngs_modulus_gpa * std::numbers::pi / 64 *
           (fourth(diameter_mm) - fourth(inner_diameter_mm));
  }

  /// Deflection at arc length s of a force of 1 N across the beam at t, in the force's direction, mm/N; symmetric.
  /// A cantilever's (S. Timoshenko, Strength of Materials I, 1940, art. 37), the hand's turn, and less what the guide's
  /// reaction takes back: C(s, t) − C(s, z) C(z, t)/C(z, z).
  double compliance(double s, double t) const {
    return unguided(s, t) - (guide_mm > 0 ? unguided(s, guide_mm) * guide_share(t) : 0);
  }
  /// Its derivative with respect to s: the slope there, 1/N.
  double slope_compliance(double s, double t) const {
    return unguided_slope(s, t) - (guide_mm > 0 ? unguided_slope(s, guide_mm) * guide_share(t) : 0);
  }
  /// Share of a force at t that the guide takes; and how far t goes for each mm that the guide is moved across.
  double guide_share(double t) const {
    return guide_mm > 0 ? unguided(guide_mm, t) / unguided(guide_mm, guide_mm) : 0;
  }

  /// The derivative of guide_share with respect to t: the slope there for each mm that the guide is moved, 1/mm.
  double guide_slope(double t) const {
    return guide_mm > 0 ? unguided_slope(t, guide_mm) / unguided(guide_mm, guide_mm) : 0;
  }

  /// The compliance without the guide.
  double unguided(double s, double t) const {
    const double least = std::min(s, t), most = std::max(s, t);
    return least * least * (3 * most - least) * (1 / (6 * bending_stiffness_nmm2)) + s * t * hand_rad_per_nmm;
  }

  bool operator==(const Beam&) const = default;

 private:
  double unguided_slope(double s, double t) const {
    const double bend = s < t ? s * (2 * t - s) : t * t;
    return bend / (2 * bending_stiffness_nmm2) + t * hand_rad_per_nmm;
  }
};

}  // namespace brachy
