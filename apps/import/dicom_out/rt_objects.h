#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/import/dicom_out/dicom_writer.h"
#include "core/base/colour_text.h"
#include "core/brachytherapy/dose/dose_grid.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// The number of a catheter's structure, behind those of the organs.
inline std::size_t catheter_roi(std::size_t structures, std::size_t catheter) {
  return structures + 1 + catheter;
}

/// An RTSTRUCT: contours of each structure in transverse planes `slice_mm` apart (contour_heights), holes by keyholes;
/// and the courses of the catheters that have one as open contours (BRACHY_CHANNEL). `catheters`: null for none.
void write_rt_structure(const std::filesystem::path& file, const ExportIds& ids,
                        const std::vector<Structure>& structures, const std::vector<Rgb>& colours,
                        double slice_mm, const HdrPlan* catheters);

/// An RTPLAN of a permanent implant: an application setup for each needle, in it a channel for each seed, with its
/// position, axis, distance behind the tip, and the source's air-kerma strength.
void write_rt_plan(const std::filesystem::path& file, const ExportIds& ids, const Plan& plan,
                   const TemplateGrid& grid);

/// An RTPLAN of a fraction of high-dose-rate brachytherapy: one application setup, in it a channel for each catheter in
/// which the source dwells, with two control points for each dwell and time weights in seconds. A catheter with a
/// course names its structure in a set of `structures` organs.
void write_rt_plan(const std::filesystem::path& file, const ExportIds& ids, const HdrPlan& plan,
                   const TemplateGrid& grid, std::size_t structures);

/// An RTDOSE: the total dose of the grid in Gy, transverse, rows and columns along LPS, `bits` (16 or 32) a voxel: to
/// the largest dose / 131,070, or in as many digits as the grid's floats have.
void write_rt_dose(const std::filesystem::path& file, const ExportIds& ids, const DoseGrid& grid,
                   bool has_plan, int bits);

}  // namespace brachy
