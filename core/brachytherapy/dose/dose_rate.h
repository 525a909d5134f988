#pragma once

#include <span>

#include "core/brachytherapy/dose/dose_seed.h"
#include "core/brachytherapy/dose/source.h"

// Dose in water about a seed: the exact 2-D line-source formalism of AAPM TG-43U1 (Rivard et al., Med. Phys. 31, 2004,
// 633–674, equation 1),
//
//   Ḋ(r, θ) = S_K Λ G_L(r, θ)/G_L(1 cm, 90°) g_L(r) F(r, θ),
//
// with (r, θ) or z = r cos θ along the seed and ρ = r sin θ away from it; total dose = Ḋ T½/ln 2 (all of the decay). No
// attenuation by other seeds, no tissue but water. Threads: any. Real-time: no allocation, no exception.
namespace brachy {

/// G_L = β/(L r sin θ), 1/cm² (equation 4), β the angle that the active length L subtends at the point, as
/// atan2(Lρ, ρ² + z² − L²/4), which keeps its digits near the axis; on the axis beyond the active length 1/(z² − L²/4),
/// its limit. Not finite on the active line itself. ρ ≥ 0; cm.
double geometry_function(double active_length_cm, double rho_cm, double z_cm);

/// g_L(r): the logarithm linear in r between the table's nodes, the first value below them, and beyond the last one the
/// line through the last two (TG-43U1S1). r ≥ 0, cm.
double radial_dose_function(const Tg43Source& source, double r_cm);

/// F(r, θ): bilinear between the table's nodes; beyond them in r the nearest (TG-43U1S1). θ 0 … 90° for a symmetric
/// source, 0 … 180° for another.
double anisotropy_function(const Tg43Source& source, double r_cm, double theta_deg);

/// Ḋ at `along_mm` along the axis from the centre and `away_mm` ≥ 0 from it for 1 U, cGy/h/U. For a symmetric source
/// either sign of `along_mm` gives the same bits; for another, positive is where θ < 90°.
///
/// Inside the capsule, where the protocol defines nothing, a point is first moved outwards, by as much along the axis
/// (from the middle) as away from it, until it lies on the capsule's surface. That is continuous, finite, symmetric and
/// preserves the values on the surface (the nearest surface point would jump between the side and the ends).
double dose_rate_per_u(const Tg43Source& source, double along_mm, double away_mm);

/// Ḋ of a seed at p (mm, world frame), cGy/h, when it is implanted. Finite wherever p is; NaN for a p that is not.
double dose_rate_cgy_h(const DoseSeed& seed, const Vec3& p);

/// Dose of a seed's whole decay for an initial dose rate of 1 cGy/h: T½/ln 2, Gy/(cGy/h).
double total_gy_per_cgy_h(SourceModel model);

/// Σ over the seeds of the dose of their whole decay at p (mm, world frame), Gy; summed in their order.
double total_dose_gy(std::span<const DoseSeed> seeds, const Vec3& p);

}  // namespace brachy
