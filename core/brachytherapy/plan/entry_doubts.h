#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// What is odd about a plan's source, strength and prescription together, a sentence each with what would be customary;
/// most often a strength in mCi that should be in U, another nuclide's strength or prescription, or a decimal point.
/// Empty: nothing, or a nuclide that is not known here. Nuclides by half-life: I-125, Pd-103, Cs-131.
///
/// Prescriptions, alone and with external beam, more or less a fifth: Davis et al. (ABS), Brachytherapy 11 (2012),
/// 6–19, and Nath et al. (AAPM TG-137), Med. Phys. 36 (2009), 5310–5322. Strengths: the ranges in which seeds for the
/// prostate are ordered, from memory of vendors' lists; they could not be verified, and are wide.
std::vector<std::string> entry_doubts(const Plan& plan);

}  // namespace brachy
