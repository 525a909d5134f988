#include "apps/score/recording.h"

#include <fstream>
#include <sstream>

#include "core/base/error.h"
#include "core/brachytherapy/seeds/failed_drop_file.h"
#include "core/brachytherapy/seeds/seed_file.h"

namespace brachy {
namespace {

/// Up to the last whole line.
std::string_view whole_lines(std::string_view text) {
  return text.substr(0, text.rfind('\n') + 1);
}

class RecordingFiles {
 public:
  explicit RecordingFiles(const std::filesystem::path& folder) : folder_(folder) {}

  /// What `parse` makes of a file's text. Nothing, and a remark that ends with `without`, where that is impossible.
  template <class Parse>
  auto read(const std::string& name, const char* without, Parse&& parse)
      -> std::optional<decltype(parse(std::string_view(), name))> {
    const std::filesystem::path file = folder_ / name;
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(file, ignored)) {
      remarks_.push_back(name + " is missing: " + without);
      return std::nullopt;
    }
    std::ifstream in(file, std::ios::binary);
    std::ostringstream content;
    content << in.rdbuf();
    const std::string_view text = content.view(), whole = whole_lines(text);
    try {
      auto parsed = parse(whole, name);
      if (whole.size() < text.size())
        remarks_.push_back(name + " ends within a line, which was left out: what came after is not known.");
      return parsed;
    } catch (const UserError& error) {
      remarks_.push_back(std::string(error.what()) + ". It cannot be read: " + without);
      return std::nullopt;
    }
  }

  bool has(const char* name) const {
    std::error_code ignored;
    return std::filesystem::exists(folder_ / name, ignored);
  }
  std::vector<std::string> take_remarks() { return std::move(remarks_); }

 private:
  const std::filesystem::path& folder_;
  std::vector<std::string> remarks_;
};

/// A directory's own name, however the path is written.
std::string name_of(const std::filesystem::path& folder) {
  const std::filesystem::path whole = std::filesystem::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

}  // namespace

Recording load_recording(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    throw UserError(folder.string() +
                    ": no such directory; give a recording made by `brachy record`, or a session");
  RecordingFiles files(folder);
  Recording recording;
  recording.name = name_of(folder);
  recording.poses = files.read(
      "poses.csv", "needle paths, times and passes are not known.",
      [](std::string_view text, const std::string& name) { return parse_trajectories(text, name); });
  auto forces = files.read("forces.csv", "punctures and forces are not known.", parse_force_log);
  recording.seeds =
      files.read("seeds.csv", "what was implanted, its errors and its dose are not known.", parse_seeds);
  if (files.has("drops.csv"))
    recording.failed_drops =
        files.read("drops.csv", "lost and refused seeds are not known.", parse_failed_drops);
  if (files.has("contacts.csv"))
    recording.passes = files.read("contacts.csv", "passes through organs are those of the organs at rest.",
                                  parse_organ_passes);
  if (files.has(kStudiesFile))
    if (auto studies = files.read(kStudiesFile, "volume studies are not known.", parse_studies))
      recording.studies = std::move(*studies);
  if (!recording.poses && !forces && !recording.seeds)
    throw UserError(folder.string() +
                    ": has no readable recording; it should contain poses.csv, forces.csv "
                    "and seeds.csv (" +
                    files.take_remarks().front() + ")");
  if (forces) recording.forces = std::move(*forces);
  recording.remarks = files.take_remarks();
  return recording;
}

}  // namespace brachy
