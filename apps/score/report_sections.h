#pragma once

#include <span>
#include <string>
#include <vector>

#include "apps/score/score.h"

namespace brachy {

// Parts of the page, as HTML; empty where nothing is known.

/// Axial slices side by side: outlines of the structures, isodoses, sources as planned and as delivered (mm, at rest),
/// each with those within half a slice's spacing. `sources`: "seeds" or "dwell positions".
std::string slices_section(const std::vector<AxialSlice>& slices, const char* sources,
                           std::span<const Vec3> planned, std::span<const Vec3> delivered);

/// The goals of the plan and of the implant, and whether they are met.
std::string goals_section(const Score& score);

/// What each needle cost, cold sectors, the urethra's hottest place, organs entered, seeds lost and refused.
std::string consequences_section(const Score& score, const Plan& plan);

/// Volume studies: figures of each, and of the last one's planes. As HTML, and as lines for a terminal; empty: none.
std::string study_section(const Score& score);
std::string study_lines(const Score& score);

}  // namespace brachy
