#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/recording_folder.h"
#include "apps/brachy/tools.h"
#include "apps/terminal/progress.h"

namespace brachy {
namespace {

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

}  // namespace

int export_recording(const ExportOptions& options) {
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
              << "; what stands before it was exported\n";
  if (options.json)
    std::cout << to_json(folder, reader.damage()).dump() << "\n";
  else
    std::cout << "export: " << to_text(folder) << "\n";
  return kExitOk;
}

}  // namespace brachy
