#include <fmt/format.h>

#include <iostream>

#include "apps/command_line/tool.h"
#include "apps/import/case/imported_case.h"
#include "apps/terminal/progress.h"
#include "core/base/escaped.h"

namespace brachy {
namespace {

struct ImportLine {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path out;
  std::string gland;
  bool keep_identifiers = false, force = false;
};

int run(const ImportLine& line) {
  ImportOptions options;
  for (const auto& input : line.inputs) options.inputs.push_back(input.string());
  options.gland = line.gland;
  options.keep_identifiers = line.keep_identifiers;
  std::error_code ignored;
  if (!line.force && std::filesystem::exists(line.out, ignored) &&
      !std::filesystem::is_empty(line.out, ignored))
    throw UserError(line.out.string() + ": is not empty; choose another --out, or give --force");
  Progress progress("import");
  const ImportedCase imported =
      read_case(options, [&](double share, const std::string& what) { progress.show(share, what); });
  progress.show(1, "writing");
  write_case(imported, line.out, line.force);
  progress.finish();
  std::cout << "import: " << (line.out / "scene.toml").string() << "\n";
  for (const ImportedStructure& s : imported.structures) {
    std::cout << fmt::format("  {:<16} {:>9.2f} cc, {} vertices, from {}\n", s.name, s.surface_cc,
                             s.mesh.vertices.size(), s.from);
    for (const std::string& note : s.notes) std::cout << "    " << note << "\n";
  }
  if (imported.plan) {
    std::cout << fmt::format("  plan: {} needles, {} seeds of {:g} U\n", imported.plan->plan.needles.size(),
                             imported.plan->plan.seed_count(), imported.plan->plan.air_kerma_strength_u);
    for (const std::string& note : imported.plan->notes) std::cout << "    " << note << "\n";
  }
  if (imported.dose) std::cout << "  dose: dose.nrrd\n";
  if (imported.volume) std::cout << "  volume: volume.nrrd\n";
  for (const std::string& left : imported.left) std::cerr << "import: left: " << escaped(left) << "\n";
  for (const std::string& tag : imported.dropped) std::cerr << "import: dropped: " << escaped(tag) << "\n";
  return kExitOk;
}

void declare(OptionList& list, ImportLine& line) {
  list.add("inputs", line.inputs, "folders, DICOM files, label maps (.nrrd, .seg.nrrd, .nii, .nii.gz)")
      .required();
  list.add("--out", line.out, "folder to write; created if missing, must be empty").required();
  list.add("--gland", line.gland,
           "the structure that is the gland; by default the one that is called prostate, ctv, …");
  list.add_flag("--keep-identifiers", line.keep_identifiers,
                "write what identifies the patient to import.json");
  list.add_flag("--force", line.force,
                "write into a folder that is not empty, over files of an earlier import");
}

}  // namespace

Tool import_tool() {
  return make_tool<ImportLine>("import", "Make a scene of a patient's DICOM RT files or of a label map.",
                               R"(Examples:
  brachy import export_of_planning_system/ --out patient
  brachy import RS.dcm RP.dcm RD.dcm --out patient
  brachy import segmentation.seg.nrrd --gland label_3 --out patient
  brachy plan --generate --config patient/scene.toml --out patient/plan.toml
Writes scene.toml, a closed surface (PLY, RAS) for each structure, plan.toml of a permanent implant, dose.nrrd,
volume.nrrd of the longest image series, and import.json: what was taken from where, what was left. Asks nothing;
the same files give the same bytes. Nothing that identifies the patient is written without --keep-identifiers; the
tags that were dropped are listed on standard error.
Exit codes: 0 done, 1 the disk failed, 2 bad input: one line with the file, the tag and the fix.)",
                               declare, run);
}

}  // namespace brachy
