#include <fmt/format.h>

#include <iostream>

#include "apps/command_line/tool.h"
#include "apps/import/case/imported_case.h"
#include "apps/import/check/dose_check.h"
#include "apps/terminal/progress.h"
#include "core/base/escaped.h"

namespace brachy {
namespace {

struct ImportLine {
  std::vector<std::filesystem::path> inputs;
  std::filesystem::path out;
  std::string gland, source;
  std::vector<std::string> roles, leave, only;
  bool keep_identifiers = false, force = false, json = false;
};

/// "RS.dcm (file 3 of 12): …": at the terminal the name helps; import.json has none, as it could be a person's.
std::string with_file_names(std::string text, const std::vector<std::string>& files) {
  for (std::size_t n = files.size(); n-- > 0;) {
    const std::string place = "file " + std::to_string(n + 1) + " of " + std::to_string(files.size());
    if (const auto at = text.find(place); at != std::string::npos)
      text.replace(at, place.size(),
                   std::filesystem::path(files[n]).filename().string() + " (" + place + ")");
  }
  return text;
}

int run(const ImportLine& line) {
  ImportOptions options;
  for (const auto& input : line.inputs) options.inputs.push_back(input.string());
  options.gland = line.gland;
  options.source = line.source;
  options.roles = line.roles;
  options.leave = line.leave;
  options.only = line.only;
  options.keep_identifiers = line.keep_identifiers;
  std::error_code ignored;
  if (!line.force && std::filesystem::exists(line.out, ignored) &&
      !std::filesystem::is_empty(line.out, ignored))
    throw UserError(line.out.string() + ": is not empty; choose another --out, or give --force");
  Progress progress("import");
  ImportedCase imported =
      read_case(options, [&](double share, const std::string& what) { progress.show(share, what); });
  take_fitting_source(imported);
  progress.show(1, "writing");
  write_case(imported, line.out, line.force);
  progress.finish();
  if (line.json) {
    std::cout << report_text(imported);
    return kExitOk;
  }
  for (const std::string& warning : imported.warnings)
    std::cout << "import: WARNING: " << escaped(warning) << "\n";
  std::cout << "import: " << (line.out / "scene.toml").string() << "\n" << places_text(imported);
  if (imported.plan && imported.plan->hdr) {
    const HdrPlan& plan = *imported.plan->hdr;
    std::cout << fmt::format("  plan: {} catheters, {} dwells in {:.1f} s, {} of {:g} U, {:g} Gy\n",
                             plan.catheters.size(), plan.dwell_count(), plan.total_s(),
                             to_string(plan.source), plan.source_strength_u, plan.prescription_gy);
    for (const std::string& note : imported.plan->notes) std::cout << "    " << note << "\n";
  } else if (imported.plan) {
    std::cout << fmt::format("  plan: {} needles, {} seeds of {:g} U\n", imported.plan->plan.needles.size(),
                             imported.plan->plan.seed_count(), imported.plan->plan.air_kerma_strength_u);
    for (const std::string& note : imported.plan->notes) std::cout << "    " << note << "\n";
  }
  if (!imported.seeds.empty())
    std::cout << fmt::format(
        "  seeds: seeds.csv, {} as the file has them; implant.toml has them in the body\n",
        imported.seeds.size());
  if (imported.dose) std::cout << "  dose: dose.nrrd\n";
  if (imported.volume) std::cout << "  volume: volume.nrrd\n";
  for (const std::string& left : imported.left)
    std::cerr << "import: left: " << escaped(with_file_names(left, imported.files)) << "\n";
  for (const std::string& tag : imported.dropped) std::cerr << "import: dropped: " << escaped(tag) << "\n";
  return kExitOk;
}

void declare(OptionList& list, ImportLine& line) {
  list.add("inputs", line.inputs,
           "folders, DICOM files, label maps and images (.nrrd, .seg.nrrd, .nii, .nii.gz, .mha)")
      .required();
  list.add_output_folder("--out", line.out, "folder to write; created if missing, must be empty").required();
  list.add(
      "--gland", line.gland,
      "the structure that is the gland, by its name in the file; by default the one that is called prostate");
  list.add("--role", line.roles,
           "ROLE=NAME: the structure that is the urethra, rectum, bladder, pubic_arch, …; may be repeated");
  list.add("--leave", line.leave, "a structure that is not wanted, by its name; may be repeated");
  list.add("--source", line.source,
           "the source of an HDR or PDR plan whose file does not name a known one: mhdr-v2, flexisource, …");
  list.add("--only", line.only, "a structure that is wanted, and no other; may be repeated");
  list.add_flag("--json", line.json, "print import.json in place of the table");
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
  brachy import RS.dcm --gland "Prostata klein" --role rectum="Ampulle" --out patient
  brachy import RS.dcm --leave BODY --leave "Couch 1" --out patient
  brachy plan --generate --config patient/scene.toml --out patient/plan.toml
  brachy score patient/seeds.csv --config patient/scene.toml --out implant.html    # after an implant
Writes scene.toml, a closed surface (PLY, RAS) for each structure, plan.toml of a permanent implant, seeds.csv of its
seeds, also where they lie on no template, implant.toml: the scene with these in the body, dose.nrrd, volume.nrrd of the
longest image series or of an image beside the label maps, import.svg: three planes with all outlines, and import.json:
what was taken from where, where it lies, what was left, and warnings where it contradicts anatomy. Names of structures
are known in some twenty languages (TG-263's first); where two fit one organ the import asks for --gland or --role. What
is not used stops nothing: each thing that is left has a line with its file, its name and why. Asks nothing else; the
same files give the same bytes. Nothing that identifies the patient is written without --keep-identifiers; the
tags that were dropped are listed on standard error.
Exit codes: 0 done, 1 the disk failed, 2 bad input: one line with the file, the tag and the fix.)",
                               declare, run);
}

}  // namespace brachy
