#include <iostream>

#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/import/check/dose_check.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/base/escaped.h"

namespace brachy {
namespace {

constexpr int kExitDisagrees = 3;

struct CheckLine {
  std::vector<std::filesystem::path> inputs;
  std::optional<std::filesystem::path> html;
  std::string source;
  DoseCheckSettings settings;
  bool force = false, json = false;
};

int run(const CheckLine& line) {
  ImportOptions options;
  for (const auto& input : line.inputs) options.inputs.push_back(input.string());
  options.source = line.source;
  options.needs_structure = false;
  Progress progress("check-dose");
  ImportedCase read =
      read_case(options, [&](double share, const std::string& what) { progress.show(0.5 * share, what); });
  if (!read.plan || !read.plan->hdr)
    throw UserError(read.plan_fault.empty()
                        ? line.inputs.front().string() + ": has no HDR or PDR plan; give its RTPLAN"
                        : read.plan_fault);
  if (!read.dose)
    throw UserError(line.inputs.front().string() + ": no RTDOSE in the plan's frame; give the plan's dose");
  take_fitting_source(read);
  for (const std::string& left : read.left) std::cerr << "check-dose: left: " << escaped(left) << "\n";
  for (const std::string& note : read.plan->notes) std::cerr << "check-dose: " << escaped(note) << "\n";
  progress.show(0.5, "recomputing");
  const std::vector<Structure> structures = as_structures(read);
  const HdrPlan& plan = *read.plan->hdr;
  const DoseCheck check = check_dose(plan, read.grid, structures, *read.dose, read.plan_points,
                                     read.plan_date, read.strength_date, line.settings);
  if (line.html) write_text(*line.html, to_html(check, plan, read.grid, structures, *read.dose), line.force);
  progress.finish();
  std::cout << (line.json ? to_json(check, plan) : to_text(check, plan));
  return check.findings.empty() ? kExitOk : kExitDisagrees;
}

void declare(OptionList& list, CheckLine& line) {
  list.add("inputs", line.inputs,
           "folders or files: RTPLAN and RTDOSE, and RTSTRUCT for figures of structures")
      .required();
  list.add_output("--html", line.html, "page to write, with pictures");
  list.add_force(line.force);
  list.add("--source", line.source,
           "the source, where the file does not name a known one: mhdr-v2, flexisource, …");
  list.add("--least-gy", line.settings.least_gy, "compare voxels that have this dose at least")
      .range(0.01, 1000.0)
      .show_default();
  list.add("--beside-mm", line.settings.beside_mm, "and lie this far from every dwell")
      .range(1.0, 50.0)
      .show_default();
  list.add("--tolerance", line.settings.tolerance_percent,
           "largest root mean square difference that agrees, %")
      .range(0.1, 50.0)
      .show_default();
  list.add_flag("--json", line.json, "print the figures as JSON");
}

}  // namespace

Tool check_dose_tool() {
  return make_tool<CheckLine>("check-dose", "Recompute an HDR plan's dose and compare it with its RTDOSE.",
                              R"(Examples:
  brachy check-dose export_of_planning_system/ --html check.html
  brachy check-dose RP.dcm RD.dcm RS.dcm --json
  brachy check-dose folder --source gammamed-hdr --tolerance 1
Computes the dose of the plan's dwells by AAPM TG-43U1 (exact sums, line source, anisotropy) and compares it with the
planning system's at voxels, by gamma (local; 3 %/1 mm, 2 %/1 mm), by figures of structures, and at points of which the
plan states the dose. Reports, and does not correct: a shift of the dose grid, end frames that are wrong, a grid that
ends inside a structure, another source table, decay or fractions that were counted otherwise.
Exit codes: 0 the doses agree, 1 the disk failed, 2 bad input: one line with file, tag and fix, 3 the doses disagree.)",
                              declare, run);
}

}  // namespace brachy
