#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/brachytherapy/hdr/hdr_plan.h"

namespace brachy {

/// The limits that a plan's file must meet.
struct HdrPlanLimits {
  static constexpr double kLeastStrengthU = 1, kMostStrengthU = 1e5;
  static constexpr double kLeastPrescriptionGy = 1, kMostPrescriptionGy = 100;
  static constexpr double kMostTipMm = 500, kMostTipOffsetMm = 50;
  static constexpr double kMostDwellS = 3600;
  static constexpr double kMostCourseMm = 1e5;  ///< a coordinate, or a length
  static constexpr std::size_t kMostCoursePoints = 200;
  static constexpr std::size_t kMostDwells = 60;  ///< of a catheter
};

/// Does a plan's text say kind = "hdr"? Text that is no TOML does not.
bool is_hdr_plan(std::string_view text);

/// Parses a plan: kind = "hdr", name, source, source_strength_u, prescription_gy, step_mm, tip_offset_mm, and for each
/// catheter a [[catheter]] with hole, tip_mm and dwell_s, or with name, course_mm, dwell_mm and dwell_s. It may say
/// letters_from and half_steps (hole_names.h); holes then become those of `grid`. `name` stands for the file in errors.
/// Errors: UserError "file:line: what; fix": not TOML, an unknown or missing key, a value out of range, a seed for a
/// source, a hole that is not in the template or is used twice, more than 24 catheters, a dwell position in front of
/// the template, a tip that the needle does not reach, no dwell time at all.
HdrPlan parse_hdr_plan(std::string_view text, const std::string& name, const TemplateGrid& grid,
                       double needle_length_mm);
/// parse_hdr_plan of a file of at most 1 MiB.
HdrPlan load_hdr_plan(const std::filesystem::path& file, const TemplateGrid& grid, double needle_length_mm);

/// The plan as a file's text; parse_hdr_plan reads the same plan back, bit for bit. `grid`: by whose names its
/// holes are.
std::string to_toml(const HdrPlan& plan, const TemplateGrid& grid);

}  // namespace brachy
