#!/usr/bin/env python3
"""Checks that every tuned number of a tick stands in core/base/work_budget.h.

Each `constexpr` number in the tick's folders is something else: of the method, of physics, a size, or of rounding, as
the tables below say by file. One that is not in them is reported. A number made of other names only, such as
`kPoints = Tissue::kBlockSize`, is none of its own. What the tables name must exist.

usage: scripts/ci/check_budget.py [--root DIR]     exit code 1 and a line for each number
"""
import re

from complaints import end, root_of

FOLDERS = ("core/simulation", "core/models", "core/needle", "core/solve", "core/injectivity")
OWNER = "core/base/work_budget.h"

# What changes the result, and was chosen for its accuracy: by the equations, by tests or by tests/reference.
METHOD = {
    "core/injectivity/injectivity_search.cpp": "kHopeless kSteps",
    "core/injectivity/injectivity_search.h": "kMaxScale",
    "core/injectivity/kernel_bounds.cpp": "kSamples kBetweenSamples",
    "core/injectivity/scalar_cells.cpp": "kCuspReach",
    "core/models/blended/blended_kernel_cells.cpp": "kCuspReach kDecided",
    "core/models/blended/membership.cpp": "kSamples kBetweenSamples",
    "core/models/blended/membership.h": "kMaxSlope",
    "core/models/blended/reach_bounds.cpp": "kEnd",
    "core/models/blended/region_distance.cpp": "kBetweenSamples kFewCells",
    "core/models/guard/guarded_field.cpp": "kSubstepReach kClampReach kShorter kMissed kMargin",
    "core/models/matrix_kernel/landmark_columns.cpp": "kInMiddle",
    "core/models/matrix_kernel/matrix_composition.cpp": "kMet kNotFelt kStays kStaysBeyond kClose",
    "core/models/matrix_kernel/matrix_composition.h":
        "kReach kWidestCore kLeastCore kOfDistance kCorrectionReach kCorrections",
    "core/models/matrix_kernel/matrix_kernel_cells.cpp": "kSixPoints kRingCubed",
    "core/models/matrix_kernel/matrix_kernel_cells.h": "kClearance kResolution kStraight",
    "core/models/matrix_kernel/matrix_kernel_field.cpp": "kDefinite kNarrower",
    "core/models/matrix_kernel/matrix_kernel_system.cpp": "kStep",
    "core/models/matrix_kernel/near_bounds.cpp": "kPerBin kAngles kBetweenSamples kStep",
    "core/models/matrix_kernel/near_field.h": "kFarRadii kFarPieces kFarPairs kEven",
    "core/models/matrix_kernel/near_matrix.cpp": "kFarAside",
    "core/models/matrix_kernel/remainder_table.cpp": "kDeep kSlack",
    "core/models/matrix_kernel/smooth_field.cpp": "kSum kFirst kSecond kFromFirst",
    "core/models/matrix_kernel/smooth_tables.cpp": "kSmall",
    "core/models/matrix_kernel/smooth_tables.h": "kRegionSpacing kSmoothSpacing",
    "core/models/scalar_kernel/scalar_composition.cpp": "kHardlyStrained",
    "core/models/scalar_kernel/scalar_composition.h": "kReach",
    "core/needle/cut_path.h": "kResolution",
    "core/needle/needle_contact.cpp": "kBisections kPieceMm",
    "core/needle/probe_contact.cpp": "kLookAround kLetGo kNearAxis kCorePerSpacing",
    "core/needle/reaction_solver.cpp": "kPatience",
    "core/needle/side_contact.h": "kSpacingMm kTurnMm kLineCore",
    "core/solve/factor_status.h": "kMaxCondition",
}
# Of needles, hands, tissue and clinics, with the source beside them.
PHYSICS = {
    "core/needle/contact_settings.h": "kReferenceDiameter kRigidGpa kInsertedTipCore",
    "core/needle/followed_course.h": "kReachMm kHalfPieceMm",
    "core/needle/needle_bend.cpp": "kLeastArc",
    "core/needle/needle_bend.h": "kSteepest",
    "core/needle/needle_contact.cpp": "kInsideMargin kSameEntry kSameDirection kLookAhead kMostOblique kTipFriction "
                                      "kFacing kMostTurn",
    "core/needle/needle_contact.h": "kUnsolvedFade kSideOfCourseMm",
    "core/needle/side_contact.cpp": "kSteep",
    "core/simulation/body_settings.h": "kTheatre kPunctures kResolvedDays",
    "core/simulation/clinical_noise.cpp": "kTremorHz",
}
# Capacities, layouts of data, and what of it stays in registers or cache; tables that are made at set-up.
SIZE = {
    "core/injectivity/cell_loops.cpp": "kTogether kLanes",
    "core/injectivity/cell_loops.h": "kCount kLattice kEighths kCorners",
    "core/injectivity/injectivity_search.h": "kMaxDepth",
    "core/injectivity/kernel_bounds.h": "kBins",
    "core/models/blended/membership.cpp": "kBins",
    "core/models/blended/membership.h": "kMaxTissues",
    "core/models/blended/reach_bounds.h": "kBins",
    "core/models/blended/region_distance.h": "kMostCells",
    "core/models/blended/tissue_kernels.h": "kRows",
    "core/models/blocks/block_field.cpp": "kNotCondensed kOutOfReach",
    "core/models/blocks/block_kernels.cpp": "kTogether",
    "core/models/blocks/block_kernels.h": "kGroupSize",
    "core/models/blocks/clusters.cpp": "kMaxDepth",
    "core/models/blocks/clusters.h": "kBlocks",
    "core/models/matrix_kernel/far_pairs.h": "kCount",
    "core/models/matrix_kernel/landmark_columns.cpp": "kMostParts",
    "core/models/matrix_kernel/near_bounds.cpp": "kBins",
    "core/models/matrix_kernel/near_loops.cpp": "kTogether",
    "core/models/matrix_kernel/near_loops.h": "kMaxSupports kCount kFew",
    "core/models/matrix_kernel/remainder_table.cpp": "kChunk",
    "core/models/matrix_kernel/remainder_table.h": "kMaxSmoothNodes",
    "core/models/matrix_kernel/smooth_tables.h": "kStencil",
    "core/models/tissue_field.h": "kNoGroup",
    "core/needle/contact_settings.h": "kMaxCount",
    "core/needle/needle_contact.cpp": "kMaxCrossings kPathSlack",
    "core/needle/needle_contact.h": "kOldPaths",
    "core/needle/probe_settings.h": "kMaxLandmarks",
    "core/needle/side_contact.cpp": "kMostCrossings",
    "core/needle/side_contact.h": "kMaxPoints",
    "core/simulation/mesh_state.h": "kPoints kKept kPoseHistory",
    "core/simulation/model_digest.cpp": "kSamples",
    "core/simulation/simulation_model.cpp": "kPoints",
    "core/simulation/saved_state.cpp": "kFormat",
    "core/simulation/shown_mesh.h": "kChangeHistory",
    "core/solve/assembly_loops.cpp": "kHalf",
    "core/solve/inverse_loops.cpp": "kTogether",
    "core/solve/inverse_loops.h": "kColumns kRows",
    "core/solve/landmark_slots.h": "kNone kMore",
    "core/solve/panel_inverse.h": "kNone",
    "core/solve/panel_loops.cpp": "kGroup kColumns",
    "core/solve/panel_loops.h": "kRows kColumnStep kCount",
    "core/solve/symmetric_factor.h": "kNoGroup kMaxGroups",
}
# Mathematical constants, bounds of floating-point error, and stand-ins for zero and infinity.
ROUNDING = {
    "core/injectivity/fold_candidate_points.h": "kHalf kTurns",
    "core/injectivity/kernel_bounds.cpp": "kNearZero",
    "core/injectivity/scalar_cells.cpp": "kSinglePrecision kPlaceError",
    "core/models/blended/blended_kernel_cells.cpp": "kSinglePrecision",
    "core/models/blended/membership.cpp": "kQuarter",
    "core/models/blended/reach_bounds.h": "kUnknown",
    "core/models/blended/region_distance.cpp": "kSixth kHalf kFactorial",
    "core/models/blended/region_distance.h": "kHuge",
    "core/models/blocks/block_field.cpp": "kFarAway",
    "core/models/blocks/block_field.h": "kFloatError kFloatErrorPerWeight",
    "core/models/landmark_set.h": "kRestToleranceMm",
    "core/models/matrix_kernel/far_pairs.cpp": "kShare",
    "core/models/matrix_kernel/matrix_kernel_cells.cpp": "kSinglePrecision kSinglePrecisionBounds",
    "core/models/matrix_kernel/matrix_kernel_field.cpp": "kOutside",
    "core/models/matrix_kernel/near_bounds.cpp": "kDiagonal",
    "core/models/matrix_kernel/near_field.cpp": "kCoaxial",
    "core/models/matrix_kernel/near_loops.cpp": "kTiny kOverPi4 kInfinite",
    "core/models/scalar_kernel/scalar_composition.cpp": "kFarAway",
    "core/needle/needle_bend.cpp": "kArcsPerMm",
    "core/needle/needle_contact.cpp": "kNoForceN kRounding",
    "core/needle/probe_contact.cpp": "kSameNormal",
    "core/needle/reaction_solver.h": "kTolerance kRounding",
    "core/needle/side_contact.cpp": "kLeastAcross",
    "core/simulation/body_motion.cpp": "kSettled",
    "core/simulation/model_digest.cpp": "kWeightSteps",
    "core/solve/factor_status.h": "kDuplicateDistance",
    "core/solve/landmark_repair.h": "kSameDisplacement",
}
TABLES = (METHOD, PHYSICS, SIZE, ROUNDING)

DECLARATION = re.compile(r"\bconstexpr\b(?!\s*\()([^;()]*?[\s*&]k[A-Z]\w*(?:\[\d*\])*\s*(?:=|\{)[^;]*);")
DECLARED = re.compile(r"\b(k[A-Z]\w*)(?:\[\d*\])*\s*(?:=(?!=)|\{)")
NUMBER = re.compile(r"(?<![\w.])\.?\d")


def without_comments(text):
    """The text with comments and texts in quotes blanked, so that lines stay."""
    return re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', lambda m: re.sub(r"[^\n]", " ", m[0]), text, flags=re.S)


def numbers(text):
    """Name and line of each constexpr that has a number of its own."""
    text = without_comments(text)
    for declaration in DECLARATION.finditer(text):
        begins = list(DECLARED.finditer(declaration[1]))
        ends = [m.start() for m in begins[1:]] + [len(declaration[1])]
        for name, end in zip(begins, ends):
            if NUMBER.search(declaration[1][name.end():end]):
                yield name[1], text.count("\n", 0, declaration.start(1) + name.start()) + 1


def complaints_of(root):
    known = {}
    for table in TABLES:
        for file, names in table.items():
            known.setdefault(file, set()).update(names.split())
    seen = {}
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in (".h", ".cpp"):
                continue
            file = str(path.relative_to(root))
            for name, line in numbers(path.read_text()):
                seen.setdefault(file, set()).add(name)
                if name not in known.get(file, ()):
                    yield (f"{file}:{line}: {name} may be a tuned number of a tick's work: move it to {OWNER}, or "
                           "say in scripts/ci/check_budget.py what else it is")
    for file, names in sorted(known.items()):
        for name in sorted(names - seen.get(file, set())):
            yield f"scripts/ci/check_budget.py: {file} has no number {name}: take it out of the table"


def main():
    end("budget", complaints_of(root_of(__doc__)), f"no tuned number of a tick outside of {OWNER}")


if __name__ == "__main__":
    main()
