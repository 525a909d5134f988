#pragma once

#include <cstdint>

namespace brachy {

/// What a step could not do as requested; bits of TickSummary::step_flags. Sent over the wire: append only.
enum StepFlag : std::uint32_t {
  kStepSolveFailed = 1u << 0,  ///< landmark system not positive definite: the last good field is kept
  kStepSaturated = 1u << 1,    ///< a landmark's displacement was limited to contact.max_displacement_mm
  /// the needle jumped: it was taken out and put in again, without deformation
  kStepReinitialized = 1u << 2,
  kStepFolded = 1u << 3,       ///< the field folds (Certificate::place)
  kStepUncertified = 1u << 4,  ///< whether the field folds is not known
  kStepSubstepped = 1u << 5,   ///< sub-steps were composed (Certificate::substeps)
  kStepClamped = 1u << 6,  ///< landmarks were clamped to the last injective position (Certificate::held_mm)
  kStepMerged = 1u << 7,   ///< duplicate landmarks were merged
  kStepDropped = 1u << 8,  ///< landmarks were left out: contradictory, or too close for a stable solve
  kStepSlipUnsettled = 1u << 9,  ///< stick and slip did not converge: a reaction may be out of its bounds
  kStepLate = 1u << 10,   ///< the tick's work was spent: some of the tissue, or forces, are an earlier tick's
  kStepSteep = 1u << 11,  ///< a needle bends by more than 8°, for which its beam does not hold
};

}  // namespace brachy
