#pragma once

#include <string>
#include <vector>

#include "apps/import/case/imported_case.h"
#include "core/brachytherapy/dose/dvh.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/geometry/volume/volume.h"

namespace brachy {

/// What is compared, and when doses disagree.
struct DoseCheckSettings {
  double least_gy = 2;           ///< points have this dose at least, by the file
  double beside_mm = 4;          ///< and lie this far from every dwell
  double tolerance_percent = 2;  ///< of the root mean square difference, and of the mean
};

/// Differences of the recomputed dose from the file's, in percent of the file's.
struct DoseDifference {
  std::size_t points = 0;
  double mean_percent = 0, rms_percent = 0, largest_percent = 0;
};

/// Share of the points at which γ ≤ 1: of the positions within three distances, the least of (difference / allowed
/// difference)² + (distance / allowed distance)² (Low et al., Med. Phys. 25, 1998, 656–661); differences in percent of
/// the file's dose at the point (local).
struct GammaPass {
  double percent = 0, mm = 0, pass_percent = 0;
};

/// Figures of a structure, by the file's dose and by the recomputed one, of the part of it that lies in the grid.
struct FiguresOfBoth {
  std::string name;
  double volume_cc = 0, outside_percent = 0;  ///< outside_percent: of its surface's points, outside the grid
  StructureDose file, recomputed;
};

struct SourceFit {
  SourceModel model;
  DoseDifference difference;
};

struct DoseCheck {
  DoseCheckSettings settings;
  double prescription_gy = 0;
  std::vector<std::size_t> wrong_frames;  ///< from 0 on; they count in no figure
  double wrong_frames_ratio = 1;  ///< the file's dose in the worst of them, as a share of the recomputed one
  DoseDifference as_stored;
  Vec3 shift_mm = Vec3::Zero();  ///< of the file's grid, by which doses agree best; RAS
  DoseDifference shifted;
  double along_mm = 0;  ///< of all dwells towards their tips instead
  DoseDifference moved_along;
  double scale = 1;  ///< file / recomputed, at the shift
  std::vector<GammaPass> gamma, gamma_shifted;
  std::vector<FiguresOfBoth> structures;
  std::vector<SourceFit> sources;  ///< at the shift; the plan's first
  struct PointDose {
    Vec3 position;
    double file_gy = 0, recomputed_gy = 0;
  };
  std::vector<PointDose> plan_points;
  std::vector<std::string> findings;  ///< what does not agree, one line each; empty: all does
};

/// Where the file does not name its source: the one whose dose agrees best with the case's, with a note in place of the
/// one that was assumed. Nothing is done where there is no dose, or it has no point to compare.
void take_fitting_source(ImportedCase& imported);

/// Recomputes the dose of a fraction by TG-43U1 and compares it with a planning system's. `plan_date` and
/// `strength_date`: YYYYMMDD or empty. Sums in float, within 0.05 % of the exact ones (DoseGrid); those of the fits and
/// of the plan's points are exact. Errors: UserError where no point has enough dose.
DoseCheck check_dose(const HdrPlan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                     const VoxelVolume& dose, const std::vector<RtPointDose>& points,
                     const std::string& plan_date, const std::string& strength_date,
                     const DoseCheckSettings& settings);

/// "(+0.00, +0.00, -1.00) mm"
std::string shift_text(const Vec3& v);
std::string to_text(const DoseCheck& check, const HdrPlan& plan);
std::string to_json(const DoseCheck& check, const HdrPlan& plan);
/// A page by itself, with pictures.
std::string to_html(const DoseCheck& check, const HdrPlan& plan, const TemplateGrid& grid,
                    const std::vector<Structure>& structures, const VoxelVolume& dose);

}  // namespace brachy
