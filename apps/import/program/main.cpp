// The program that reads and writes DICOM: `brachy import`, `check-dose` and `export --dicom` start it.
#include <vector>

#include "apps/command_line/tool.h"

namespace brachy {

Tool import_tool();
Tool check_dose_tool();
Tool export_dicom_tool();

}  // namespace brachy

int main(int argc, char** argv) {
  const std::vector<brachy::Tool> tools = {brachy::import_tool(), brachy::check_dose_tool(),
                                           brachy::export_dicom_tool()};
  return brachy::run_tools("brachy", "Reads and writes a patient's DICOM RT files.", tools, argc, argv);
}
