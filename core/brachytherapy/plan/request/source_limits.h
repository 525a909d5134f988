#pragma once

#include <optional>
#include <string_view>

#include "core/brachytherapy/dose/source.h"

namespace brachy {

/// The strengths in which a nuclide's seeds are ordered, U each, and one that is used where nothing else is said; and
/// what is customarily prescribed for them alone, Gy (ABS: Davis et al., Brachytherapy 11 (2012) 6–19).
struct SourceLimits {
  std::string_view nuclide;
  double half_life_days;
  double least_u, most_u, customary_u;
  double customary_gy;
  std::string_view reference;  ///< where the range is from
};

/// The limits of the source's nuclide, which its half-life (within 1 %) shows; nothing for one that is not known, such
/// as an HDR source.
std::optional<SourceLimits> source_limits(SourceModel source);

/// What an implant of this source customarily has in all, U: 2.15 d² for I-125 and 145 Gy, d the gland's mean dimension
/// in cm (core/DESIGN.md, section 6). For another source or prescription in the proportion of what a sphere of diameter
/// d with evenly spread seeds needs for the same mean dose in prescriptions, by TG-43U1 with the anisotropy of 45°: the
/// mean over the distances r of two random points of a ball of radius R, p(r) = 3r²/R³ (1 − 3r/(4R) + r³/(16R³))
/// (Kendall, Moran, Geometrical Probability, 1963). A nomogram of Pd-103 of its own, as those compared in
/// J. Appl. Clin. Med. Phys. 19 (2018), is not used: they differ by more than this scaling does.
double customary_strength_u(SourceModel source, double prescription_gy, double mean_cm);

}  // namespace brachy
