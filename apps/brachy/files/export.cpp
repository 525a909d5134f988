#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/files/recording_folder.h"
#include "apps/command_line/tool.h"
#include "apps/terminal/progress.h"

namespace brachy {
namespace {

struct ExportOptions {
  std::filesystem::path recording;
  std::filesystem::path out;  ///< directory
  bool surface = false;       ///< the .vtp files hold the surface only
  bool json = false;
};

nlohmann::ordered_json to_json(const RecordingFolder& folder, const std::string& damage) {
  const RecordingFolder::Counts counts = folder.counts();
  return {{"out", folder.path().string()},
          {"runs", counts.runs},
          {"snapshots", counts.snapshots},
          {"poses", counts.poses},
          {"forces", counts.forces},
          {"seeds", counts.seeds},
          {"events", counts.events},
          {"ticks_missed", counts.ticks_missed},
          {"damage", damage.empty() ? nlohmann::json() : nlohmann::json(damage)}};
}

int run(const ExportOptions& options) {
  RecordingReader reader(options.recording);
  RecordingFolder folder(options.out, options.surface);
  const auto bytes = static_cast<double>(std::filesystem::file_size(options.recording));
  Progress progress("export");
  read_recording(reader, folder.messages(), [&] {
    progress.show(static_cast<double>(reader.offset()) / bytes,
                  fmt::format("{} snapshots", folder.counts().snapshots));
  });
  folder.close();
  progress.finish();
  if (!reader.damage().empty())
    std::cerr << "brachy: " << reader.name() << ": " << reader.damage()
              << "; everything before it was exported\n";
  if (options.json)
    std::cout << to_json(folder, reader.damage()).dump() << "\n";
  else
    std::cout << "export: " << to_text(folder) << "\n";
  return kExitOk;
}

void declare(OptionList& list, ExportOptions& options) {
  list.add("recording", options.recording, "file of `brachy record --out NAME.brachy`").required();
  list.add_output_folder("--out", options.out, "directory to write; created if missing, must be empty")
      .required();
  list.add_flag("--surface", options.surface, "write the surface only: a tenth of the space");
  list.add_flag("--json", options.json, "print the result as JSON");
}

}  // namespace

Tool export_tool() {
  return make_tool<ExportOptions>("export", "Write a recording as files for ParaView and spreadsheets.",
                                  R"(Examples:
  brachy export run1.brachy --out out/run1
  paraview out/run1/recording.pvd; brachy plot-force out/run1/forces.csv; brachy score out/run1
Writes the same files as `brachy record --out DIR`: recording.pvd with a .vtp file per snapshot, poses.csv,
forces.csv, seeds.csv, events.csv, structures/. After a reset of the simulation the rest goes into the
sub-directories run_2, run_3, …
Exit codes: 0 done, 1 the disk failed, 2 no recording, or --out holds one already.)",
                                  declare, run);
}

}  // namespace brachy
