#include <algorithm>
#include <cmath>

#include "core/base/toml_table.h"
#include "core/base/utf8.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/source_tables.h"

namespace brachy {
namespace {

constexpr double kThetaReference = 90, kThetaBack = 180;

void require_all(const TomlTable& t, std::initializer_list<const char*> keys, const char* what) {
  for (const char* key : keys)
    if (!t.has(key)) t.missing(key, what);
}

void read_text(TomlTable& t, const char* key, std::string& value) {
  t.text(key, value);
  if (value.size() > SourceTables::kLongestText)
    t.contradiction(key,
                    "is longer than " + std::to_string(SourceTables::kLongestText) + " bytes; shorten it");
  if (!is_printable(value))
    t.contradiction(key,
                    "has a line end, a control character or invalid UTF-8; write it as one line of text");
}

// Names stand in plans, scenes and lists; ".toml" marks a file there.
void check_source_name(const TomlTable& t, const std::string& name) {
  const bool is_plain = !name.empty() && name.size() <= 32 && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
  });
  if (!is_plain)
    t.contradiction("name", "is \"" + name + "\"; name it with 1 to 32 letters, digits, - and _");
}

void read_nodes(TomlTable& t, const char* key, std::vector<double>& nodes, double most) {
  t.list(key, nodes, 0, most);
  if (nodes.size() < 2 || nodes.size() > SourceTables::kMostNodes)
    t.contradiction(key, "has " + std::to_string(nodes.size()) + " entries; give 2 to " +
                             std::to_string(SourceTables::kMostNodes));
  if (std::ranges::adjacent_find(nodes, std::ranges::greater_equal()) != nodes.end())
    t.contradiction(key, "does not increase from entry to entry; sort it, each value once");
}

void read_radial(TomlTable t, SourceTables& source) {
  require_all(t, {"r_cm", "values"}, "[g] has the radii and the values of the radial dose function g_L");
  read_nodes(t, "r_cm", source.g_r_cm, SourceTables::kFarthestCm);
  t.list("values", source.g, 1e-9, 100);
  t.refuse_unknown();
  if (source.g.size() != source.g_r_cm.size())
    t.contradiction("values", "has " + std::to_string(source.g.size()) + " entries and r_cm " +
                                  std::to_string(source.g_r_cm.size()) + "; give one for each");
}

// Where the file has nan, the next value along r of the same angle, or the last one before.
void fill_row(std::vector<double>& row) {
  for (std::size_t j = row.size() - 1; j-- > 0;)
    if (std::isnan(row[j])) row[j] = row[j + 1];
  for (std::size_t j = 1; j < row.size(); ++j)
    if (std::isnan(row[j])) row[j] = row[j - 1];
}

void read_anisotropy(TomlTable t, SourceTables& source) {
  require_all(t, {"r_cm", "theta_deg", "values"},
              "[F] has the radii, the angles and the rows of the anisotropy function F");
  read_nodes(t, "r_cm", source.F_r_cm, SourceTables::kFarthestCm);
  read_nodes(t, "theta_deg", source.F_theta_deg, kThetaBack);
  std::vector<std::vector<double>> rows;
  t.rows("values", rows, 0, 100);
  t.refuse_unknown();
  const std::vector<double>& theta = source.F_theta_deg;
  if (theta.front() != 0 || (theta.back() != kThetaReference && theta.back() != kThetaBack))
    t.contradiction(
        "theta_deg",
        "must go from 0 to 90, for a source that is symmetric about its middle, or from 0 to 180");
  if (rows.size() != theta.size())
    t.contradiction("values", "has " + std::to_string(rows.size()) + " rows and theta_deg " +
                                  std::to_string(theta.size()) + " entries; give a row for each");
  if (rows.front().size() != source.F_r_cm.size())
    t.contradiction("values", "has rows of " + std::to_string(rows.front().size()) + " numbers and r_cm " +
                                  std::to_string(source.F_r_cm.size()) + "; give one for each radius");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (std::ranges::all_of(rows[i], [](double v) { return std::isnan(v); }))
      t.contradiction("values", "has only nan in row " + std::to_string(i + 1) + "; give at least one value");
    fill_row(rows[i]);
    source.F.insert(source.F.end(), rows[i].begin(), rows[i].end());
  }
}

void check_reference(TomlTable& top, const SourceTables& source) {
  const Tg43Source view = source.view(SourceModel::kFirstOfFiles);
  TomlTable g = top.table("g"), f = top.table("F");
  if (std::abs(radial_dose_function(view, 1) - 1) > SourceTables::kReferenceTolerance)
    g.contradiction("values", "gives " + text_of(radial_dose_function(view, 1)) +
                                  " at 1 cm, where g is 1; are they of g_L, and r_cm in cm?");
  for (const double r : source.F_r_cm)
    if (std::abs(anisotropy_function(view, r, kThetaReference) - 1) > SourceTables::kReferenceTolerance)
      f.contradiction("values", "gives " + text_of(anisotropy_function(view, r, kThetaReference)) + " at " +
                                    text_of(r) + " cm and 90 degrees, where F is 1; is a row missing?");
}

}  // namespace

Tg43Source SourceTables::view(SourceModel model) const {
  return {.model = model,
          .name = name,
          .description = description,
          .half_life_days = half_life_days,
          .active_length_cm = active_length_cm,
          .dose_rate_constant = dose_rate_constant,
          .g_r_cm = g_r_cm,
          .g = g,
          .F_r_cm = F_r_cm,
          .F_theta_deg = F_theta_deg,
          .F = F,
          .capsule_length_mm = capsule_length_mm,
          .capsule_diameter_mm = capsule_diameter_mm,
          .number = number,
          .is_permanent = is_permanent,
          .u_per_mci = u_per_mci,
          .citation = citation};
}

SourceTables parse_source(std::string_view text, const std::string& name) {
  TomlTable t = parse_toml(text, name);
  SourceTables source;
  std::string use = "permanent";
  t.text("name", source.name);
  t.integer("number", source.number, 1, 999'999);
  read_text(t, "description", source.description);
  read_text(t, "citation", source.citation);
  read_text(t, "doi", source.doi);
  t.text("use", use, {"permanent", "temporary"});
  t.number("half_life_days", source.half_life_days, 0.1, 1e5);
  t.number("dose_rate_constant", source.dose_rate_constant, 0.01, 10);
  t.number("active_length_cm", source.active_length_cm, 0.01, 5);
  t.number("capsule_length_mm", source.capsule_length_mm, 0.1, 60);
  t.number("capsule_diameter_mm", source.capsule_diameter_mm, 0.1, 5);
  t.number("u_per_mci", source.u_per_mci, 1e-3, 1e3);
  TomlTable g = t.table("g"), f = t.table("F");
  t.refuse_unknown();
  require_all(t,
              {"name", "number", "description", "citation", "use", "half_life_days", "dose_rate_constant",
               "active_length_cm", "g", "F"},
              "config/README.md says what a source file has, and config/sources has some");
  check_source_name(t, source.name);
  source.is_permanent = use == "permanent";
  read_radial(g, source);
  read_anisotropy(f, source);
  if (10 * source.active_length_cm > source.capsule_length_mm)
    t.contradiction("active_length_cm", "is longer than the capsule of " + text_of(source.capsule_length_mm) +
                                            " mm; active_length_cm is in cm, capsule_length_mm in mm");
  check_reference(t, source);
  return source;
}

}  // namespace brachy
