#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/base/toml_table.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/plan/hole_names.h"
#include "core/brachytherapy/plan/plan_check.h"
#include "core/brachytherapy/plan/plan_file.h"

namespace brachy {
namespace {

void require(const TomlTable& t, std::initializer_list<const char*> keys, const char* what) {
  for (const char* key : keys)
    if (!t.has(key)) t.missing(key, what);
}

void read_needle(TomlTable t, Plan& plan, const PlanLimits& limits) {
  PlanNeedle& needle = plan.needles.emplace_back();
  t.text("hole", needle.hole);
  t.number("retraction_mm", needle.retraction_mm, 0, PlanLimits::kMostRetractionMm);
  t.text("train", needle.train);
  t.refuse_unknown();
  require(t, {"hole", "train"}, "a [[needle]] has a hole and a train, such as \"D4\" and \"s-s--s\"");
  check_needle(plan, plan.needles.size() - 1, limits,
               [&](const char* key, const std::string& what) { t.contradiction(key, what); });
}

/// The text between the quotes.
std::string toml_escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

}  // namespace

Plan parse_plan_toml(std::string_view text, const std::string& name, const TemplateGrid& grid,
                     double needle_length_mm) {
  TomlTable t = parse_toml(text, name);
  Plan plan;
  std::string source = "6711";
  t.text("name", plan.name);
  t.text("source", source);
  t.number("air_kerma_strength_u", plan.air_kerma_strength_u, PlanLimits::kLeastStrengthU,
           PlanLimits::kMostStrengthU);
  t.number("prescription_gy", plan.prescription_gy, PlanLimits::kLeastPrescriptionGy,
           PlanLimits::kMostPrescriptionGy);
  t.number("base_plane_mm", plan.base_plane_mm, PlanLimits::kLeastBasePlaneMm, PlanLimits::kMostBasePlaneMm);
  const TemplateGrid named = read_hole_names(t, grid);
  std::vector<TomlTable> needles = t.tables("needle");
  t.refuse_unknown();
  const auto model = find_seed_source(source);
  if (!model)
    t.contradiction("source", "is \"" + one_short_line(source) + "\"; it must be one of: " + source_names() +
                                  "; a scene's dose.source adds one");
  plan.source = *model;
  check_name(plan.name, [&](const char* key, const std::string& what) { t.contradiction(key, what); });
  require(t, {"source", "air_kerma_strength_u", "prescription_gy", "base_plane_mm"},
          "a plan has the seeds' source and strength, the dose and the base plane; `brachy plan "
          "--generate` writes one");
  require(t, {"needle"}, "a plan has at least one [[needle]]");
  for (TomlTable& needle : needles) read_needle(needle, plan, {named, needle_length_mm});
  rename_holes(plan.needles, named, grid);
  return plan;
}

std::string to_toml(const Plan& plan, const TemplateGrid& grid, const std::vector<std::string>& notes) {
  std::string out = "# Needles through a template and the seeds they leave; mm, U, Gy.\n";
  for (const std::string& note : notes) out += "# Note: " + note + "\n";
  out += "name = \"" + toml_escaped(plan.name) + "\"\n";
  out += "source = \"" + std::string(to_string(plan.source)) + "\"\n";
  out += "air_kerma_strength_u = " + exact_text(plan.air_kerma_strength_u) + "  # of each seed\n";
  out += "prescription_gy = " + exact_text(plan.prescription_gy) + "\n";
  out += "base_plane_mm = " + exact_text(plan.base_plane_mm) +
         "  # from the template's plane along the needles\n";
  out += hole_names_toml(grid);
  out +=
      "# retraction_mm: how far short of the base plane the tip stops. train: from the tip backwards, s a "
      "seed of\n";
  out += "# 4.5 mm, - a spacer of 5.5 mm.\n";
  for (const PlanNeedle& needle : plan.needles)
    out += "\n[[needle]]\nhole = \"" + needle.hole +
           "\"\nretraction_mm = " + exact_text(needle.retraction_mm) + "\ntrain = \"" + needle.train + "\"\n";
  return out;
}

}  // namespace brachy
