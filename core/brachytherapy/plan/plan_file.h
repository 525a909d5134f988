#pragma once

#include <filesystem>
#include <string>

#include "core/brachytherapy/plan/plan.h"
#include "core/needle/contact_settings.h"

namespace brachy {

/// Reads a plan from a file: .toml, or .csv by its extension.
///
/// TOML: name, source ("6711", "200"), air_kerma_strength_u, prescription_gy, base_plane_mm, and for each needle a
/// [[needle]] with hole, retraction_mm (default 0) and train. CSV: the header kPlanCsvHeader and a row for each needle;
/// the columns after `train` are the plan's and the same in every row. Lines that start with # are skipped. Both may
/// say letters_from and half_steps (hole_names.h; of CSV two more columns); holes then become those of `grid`.
///
/// Errors: UserError "file:line: what; fix": no such file, not TOML or CSV, an unknown key (with the nearest), a
/// value out of range, a hole that is not in the template or is used twice, a train without a seed or with another
/// letter than s and -, one that reaches back to the template, a tip that the needle does not reach. Not real-time.
Plan load_plan(const std::filesystem::path& file, const TemplateGrid& grid,
               double needle_length_mm = NeedleSettings().length_mm);

inline constexpr const char* kPlanCsvHeader =
    "hole,retraction_mm,train,base_plane_mm,source,air_kerma_strength_u,prescription_gy,name";

/// The plan as a file's text; load_plan reads the same plan back, bit for bit. `grid`: by whose names its holes are.
/// `notes`: what was assumed for it, a line each, as comments.
std::string to_toml(const Plan& plan, const TemplateGrid& grid, const std::vector<std::string>& notes = {});
std::string to_csv(const Plan& plan, const TemplateGrid& grid, const std::vector<std::string>& notes = {});

/// The same from text; `name` stands for the file in messages.
Plan parse_plan_toml(std::string_view text, const std::string& name, const TemplateGrid& grid,
                     double needle_length_mm);
Plan parse_plan_csv(std::string_view text, const std::string& name, const TemplateGrid& grid,
                    double needle_length_mm);

}  // namespace brachy
