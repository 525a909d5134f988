#include <algorithm>
#include <fstream>
#include <sstream>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/base/toml_precheck.h"
#include "core/base/toml_table.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/hole_names.h"
#include "core/brachytherapy/plan/plan_check.h"

namespace brachy {
namespace {

void require_keys(const TomlTable& t, std::initializer_list<const char*> keys, const char* what) {
  for (const char* key : keys)
    if (!t.has(key)) t.missing(key, what);
}

void check_dwell_count(const TomlTable& t, const PlanCatheter& catheter) {
  const std::size_t count = catheter.dwell_s.size();
  if (count == 0 || count > HdrPlanLimits::kMostDwells)
    t.contradiction("dwell_s", "has " + std::to_string(count) + " times; give 1 to " +
                                   std::to_string(HdrPlanLimits::kMostDwells));
}

/// A catheter with a course of its own.
void read_course(TomlTable& t, PlanCatheter& catheter, double needle_length_mm) {
  using L = HdrPlanLimits;
  std::vector<std::vector<double>> points;
  t.text("name", catheter.name);
  t.rows("course_mm", points, -L::kMostCourseMm, L::kMostCourseMm);
  t.list("dwell_mm", catheter.dwell_mm, 0, L::kMostCourseMm);
  t.list("dwell_s", catheter.dwell_s, 0, L::kMostDwellS);
  t.refuse_unknown();
  require_keys(t, {"name", "course_mm", "dwell_mm", "dwell_s"},
               "a [[catheter]] with a course has a name, the course from the tip backwards, and place and "
               "time of each dwell position");
  check_name(catheter.name, [&](const char* key, const std::string& what) { t.contradiction(key, what); });
  if (points.size() < 2 || points.size() > L::kMostCoursePoints)
    t.contradiction("course_mm", "has " + std::to_string(points.size()) + " points; give 2 to " +
                                     std::to_string(L::kMostCoursePoints));
  double length = 0;
  for (const std::vector<double>& p : points) {
    if (p.size() != 3) t.contradiction("course_mm", "has a point that is no x, y, z");
    catheter.course.emplace_back(p[0], p[1], p[2]);
    if (!catheter.course.back().allFinite()) t.contradiction("course_mm", "has a point that is no number");
    if (catheter.course.size() < 2) continue;
    const double step = (catheter.course.back() - catheter.course.end()[-2]).norm();
    if (step < 1e-3) t.contradiction("course_mm", "has the same point twice in a row; give it once");
    length += step;
  }
  if (length > needle_length_mm)
    t.contradiction("course_mm", "is " + text_of(length) + " mm long and the needle " +
                                     text_of(needle_length_mm) + " mm; raise needle.length_mm");
  check_dwell_count(t, catheter);
  if (catheter.dwell_mm.size() != catheter.dwell_s.size())
    t.contradiction("dwell_mm", "has " + std::to_string(catheter.dwell_mm.size()) + " places for " +
                                    std::to_string(catheter.dwell_s.size()) + " times; give one for each");
  if (!std::ranges::is_sorted(catheter.dwell_mm) || catheter.dwell_mm.back() > length + 1e-6)
    t.contradiction("dwell_mm", "must increase from the tip to the course's end, " + text_of(length) + " mm");
}

void read_catheter(TomlTable t, HdrPlan& plan, const TemplateGrid& grid, double needle_length_mm) {
  PlanCatheter& catheter = plan.catheters.emplace_back();
  if (t.has("course_mm")) return read_course(t, catheter, needle_length_mm);
  t.text("hole", catheter.hole);
  t.number("tip_mm", catheter.tip_mm, 0, HdrPlanLimits::kMostTipMm);
  t.list("dwell_s", catheter.dwell_s, 0, HdrPlanLimits::kMostDwellS);
  t.refuse_unknown();
  require_keys(
      t, {"hole", "tip_mm", "dwell_s"},
      "a [[catheter]] has a hole, the tip's mm beyond the template, and the time of each dwell position");
  if (!grid.position(catheter.hole))
    t.contradiction("hole", "is \"" + one_short_line(catheter.hole) + "\"; " + grid.lacks(catheter.hole));
  for (std::size_t before = 0; before + 1 < plan.catheters.size(); ++before)
    if (plan.catheters[before].hole == catheter.hole)
      t.contradiction("hole", "is \"" + catheter.hole + "\" for the second time; use each hole once");
  if (catheter.tip_mm > needle_length_mm)
    t.contradiction("tip_mm", "is " + text_of(catheter.tip_mm) + " and the needle is " +
                                  text_of(needle_length_mm) + " mm long; lower it");
  check_dwell_count(t, catheter);
  const double last = plan.straight_offset_mm(catheter.dwell_s.size() - 1);
  if (last > catheter.tip_mm)
    t.contradiction("dwell_s", "reaches " + text_of(last) + " mm behind the tip, which is " +
                                   text_of(catheter.tip_mm) + " mm beyond the template; give fewer times");
}

SourceModel read_source(TomlTable& t) {
  std::string name;
  t.text("source", name);
  const auto model = find_source(name);
  if (!model || tg43_source(*model).is_permanent)
    t.contradiction("source", "is \"" + one_short_line(name) + "\"; it must be one of: " +
                                  source_names(false) + "; a scene's dose.source adds one");
  return *model;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

}  // namespace

bool is_hdr_plan(std::string_view text) {
  try {
    TomlTable t = parse_toml(text, "plan");
    std::string kind;
    t.text("kind", kind);
    return kind == "hdr";
  } catch (const UserError&) {
    return false;
  }
}

HdrPlan parse_hdr_plan(std::string_view text, const std::string& name, const TemplateGrid& grid,
                       double needle_length_mm) {
  using L = HdrPlanLimits;
  TomlTable t = parse_toml(text, name);
  HdrPlan plan;
  std::string kind;
  t.text("kind", kind, {"hdr"});
  t.text("name", plan.name);
  require_keys(t, {"kind", "source"},
               "a plan of HDR has kind = \"hdr\" and a source; `brachy plan --generate` writes one");
  plan.source = read_source(t);
  t.number("source_strength_u", plan.source_strength_u, L::kLeastStrengthU, L::kMostStrengthU);
  t.number("prescription_gy", plan.prescription_gy, L::kLeastPrescriptionGy, L::kMostPrescriptionGy);
  t.number("step_mm", plan.step_mm, 1, 10);
  t.number("tip_offset_mm", plan.tip_offset_mm, 0, L::kMostTipOffsetMm);
  const TemplateGrid named = read_hole_names(t, grid);
  std::vector<TomlTable> catheters = t.tables("catheter");
  t.refuse_unknown();
  check_name(plan.name, [&](const char* key, const std::string& what) { t.contradiction(key, what); });
  require_keys(
      t, {"source_strength_u", "prescription_gy", "step_mm", "tip_offset_mm", "catheter"},
      "`brachy plan --generate` with a scene of implant.kind = \"hdr\" writes a plan with all of them");
  if (catheters.size() > ImplantSettings::kMaxCatheters)
    t.contradiction("catheter", "stands there " + std::to_string(catheters.size()) + " times; give at most " +
                                    std::to_string(ImplantSettings::kMaxCatheters));
  for (TomlTable& catheter : catheters) read_catheter(catheter, plan, named, needle_length_mm);
  rename_holes(plan.catheters, named, grid);
  if (plan.dwell_count() == 0) t.contradiction("catheter", "has no dwell time above 0; give one");
  return plan;
}

HdrPlan load_hdr_plan(const std::filesystem::path& file, const TemplateGrid& grid, double needle_length_mm) {
  const std::string name = file.string();
  std::error_code error;
  refuse_denied_folder(file);
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(name + ": no such plan; `brachy plan --generate --out " + name + "` writes one");
  if (std::filesystem::file_size(file, error) > TomlLimits::kMaxBytes)
    throw UserError(name + ": larger than 1 MiB; a plan is a page of TOML");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(name + ": cannot be read; check its permissions");
  return parse_hdr_plan(text.str(), name, grid, needle_length_mm);
}

std::string to_toml(const HdrPlan& plan, const TemplateGrid& grid) {
  std::string out = "# Catheters through a template, and how long the source dwells in them; mm, U, Gy, s.\n";
  out += "kind = \"hdr\"\nname = " + quoted(plan.name) + "\n";
  out += "source = \"" + std::string(to_string(plan.source)) + "\"\n";
  out += "source_strength_u = " + exact_text(plan.source_strength_u) + "  # on the day\n";
  out += "prescription_gy = " + exact_text(plan.prescription_gy) + "  # of this fraction\n";
  out += "step_mm = " + exact_text(plan.step_mm) + "  # between dwell positions\n";
  out += "tip_offset_mm = " + exact_text(plan.tip_offset_mm) + "  # of the first one behind the tip\n";
  out += hole_names_toml(grid);
  out +=
      "# tip_mm: beyond the template's plane. dwell_s: seconds at each dwell position, from the tip "
      "backwards.\n"
      "# course_mm: x, y, z from the tip backwards; dwell_mm: of each dwell position behind it.\n";
  const auto list = [](const std::vector<double>& values) {
    std::string text = "[";
    for (std::size_t i = 0; i < values.size(); ++i) text += (i ? ", " : "") + exact_text(values[i]);
    return text + "]\n";
  };
  for (const PlanCatheter& catheter : plan.catheters) {
    if (catheter.has_course()) {
      out += "\n[[catheter]]\nname = " + quoted(catheter.name) + "\ncourse_mm = [";
      for (const Vec3& p : catheter.course)
        out += "\n  [" + exact_text(p.x()) + ", " + exact_text(p.y()) + ", " + exact_text(p.z()) + "],";
      out += "\n]\ndwell_mm = " + list(catheter.dwell_mm) + "dwell_s = " + list(catheter.dwell_s);
      continue;
    }
    out += "\n[[catheter]]\nhole = \"" + catheter.hole + "\"\ntip_mm = " + exact_text(catheter.tip_mm) +
           "\ndwell_s = " + list(catheter.dwell_s);
  }
  return out;
}

}  // namespace brachy
