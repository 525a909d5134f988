// The tools of `brachy`, in the order of its help. A tool is a file of its own and two lines here; see README.md.
#include <algorithm>
#include <iostream>
#include <string_view>
#include <vector>

#include "apps/command_line/exec_sibling.h"
#include "apps/command_line/study_commands.h"
#include "apps/command_line/tool.h"
#include "core/base/escaped.h"

namespace brachy {

Tool replay_tool();
Tool watch_tool();
Tool record_tool();
Tool relay_tool();
Tool export_tool();
Tool deform_tool();
Tool dose_tool();
Tool inspect_tool();
Tool advise_tool();
Tool plot_force_tool();
Tool metrics_tool();
Tool score_tool();
Tool plan_tool();
Tool robust_tool();
Tool token_tool();
Tool us_tool();
Tool contour_tool();

}  // namespace brachy

namespace {

using namespace brachy;

std::vector<Tool> all_tools() {
  std::vector<Tool> tools = {replay_tool(), watch_tool(),  record_tool(), relay_tool(),
                             export_tool(), deform_tool(), dose_tool(),   inspect_tool()};
  // Its arguments are parsed by brachy-import.
  tools.push_back({"import", "Make a scene of a patient's DICOM RT files or of a label map.", "", {}});
  tools.push_back({"check-dose", "Recompute an HDR plan's dose and compare it with its RTDOSE.", "", {}});
  // Their arguments are parsed by brachy-study, of the laboratory.
  for (const StudyCommand& command : kStudyCommands) tools.push_back({command.name, command.summary, "", {}});
  for (const auto tool : {advise_tool, plot_force_tool, metrics_tool, score_tool, plan_tool, robust_tool,
                          token_tool, us_tool, contour_tool})
    tools.push_back(tool());
  return tools;
}

/// Whether a command line is one of brachy-import: `import …`, `check-dose …`, or `export` with the option --dicom.
bool is_import_command(int argc, char** argv) {
  if (argc < 2) return false;
  const std::string_view command = argv[1];
  return command == "import" || command == "check-dose" ||
         (command == "export" && std::any_of(argv + 2, argv + argc, [](std::string_view word) {
            return word == "--dicom" || word.starts_with("--dicom=");
          }));
}

}  // namespace

int main(int argc, char** argv) {
  if (is_import_command(argc, argv) || (argc > 1 && is_study_command(argv[1]))) {
    try {
      if (is_import_command(argc, argv))
        exec_sibling(
            "brachy-import", argv[1], argv,
            "install the package brachyd-import, or libdcmtk-dev and build with scripts/build.sh release "
            "brachy-import");
      exec_sibling("brachy-study", argv[1], argv,
                   "install the package brachyd-lab, or build it with scripts/build.sh release brachy-study "
                   "(CMake option BRACHY_LAB)");
    } catch (const UserError& e) {
      std::cerr << "brachy: " << escaped(e.what()) << "\n";
      return kExitBadInput;
    }
  }
  return run_tools("brachy", "Tools for the brachytherapy simulator.", all_tools(), argc, argv);
}
