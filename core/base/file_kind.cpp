#include "core/base/file_kind.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <optional>
#include <string_view>

#include "core/base/one_line.h"

namespace brachy {
namespace {

constexpr std::size_t kLooked = 1 << 16;

std::string head_of(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return "";  // a pipe could block
  std::string text(kLooked, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(in.gcount(), 0)));
  return text;
}

/// Whether a line of the text begins so.
bool has_line(std::string_view text, std::string_view begin) {
  std::size_t at = 0;
  while (!text.substr(at).starts_with(begin)) {
    at = text.find('\n', at);
    if (at == std::string_view::npos) return false;
    ++at;
  }
  return true;
}

std::optional<FileKind> kind_of_toml(std::string_view text) {
  if (has_line(text, "[passes]")) return FileKind::kExercise;
  if (has_line(text, "[[catheter]]")) return FileKind::kHdrPlan;
  if (has_line(text, "[[needle]]")) return FileKind::kPlan;
  if (has_line(text, "half_life_days")) return FileKind::kSource;
  for (const std::string_view table : {"[model]", "[tissue]", "[device]", "[server]", "[contact]", "[needle]",
                                       "[rates]", "[plan]", "[seeds]", "[template]", "[dose]"})
    if (has_line(text, table)) return FileKind::kScene;
  return {};
}

std::optional<FileKind> kind_of(const std::filesystem::path& file) {
  std::string ending = file.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const std::string text = head_of(file);
  if (text.empty()) return {};
  if (text.starts_with("BRCYREC")) return FileKind::kRecording;
  if (text.size() > 132 && std::string_view(text).substr(128, 4) == "DICM") return FileKind::kDicom;
  if (text.starts_with("NRRD")) return FileKind::kVolume;
  if (ending == ".toml") return kind_of_toml(text);
  if (ending == ".csv" && has_line(text, "t_s,")) return FileKind::kTrajectory;
  if (ending == ".stl" || ending == ".ply" || ending == ".obj") return FileKind::kMesh;
  return {};
}

/// The value of `scene = "…"` of an exercise; "": there is none.
std::string scene_of(const std::string& text) {
  constexpr std::string_view kKey = "\nscene = \"";
  const std::size_t at = text.find(kKey);
  if (at == std::string::npos) return "";
  std::string value = text.substr(at + kKey.size());
  value.erase(std::min(value.find_first_of("\"\n"), value.size()));
  return value;
}

/// What to give instead, or how the file given is used; "": nothing better is known.
std::string advice(const std::filesystem::path& file, FileKind kind, FileKind wanted) {
  const std::string name = one_line(file.string());
  if (kind == FileKind::kExercise && wanted == FileKind::kScene) {
    const std::string scene = scene_of(head_of(file));
    if (!scene.empty()) return one_line((file.parent_path() / scene).string());
  }
  if (kind == FileKind::kPlan && wanted == FileKind::kScene)
    return "one that names it: [plan] file = \"" + name + "\"";
  if (kind == FileKind::kHdrPlan && wanted == FileKind::kScene)
    return "one of [implant] kind = \"hdr\" that names it: [plan] file = \"" + name + "\"";
  if (kind == FileKind::kTrajectory && wanted == FileKind::kScene)
    return "config/prostate.toml; and give this with --trajectory " + name;
  if (kind == FileKind::kRecording)
    return "open this in the viewer (Open recording…), or play it with `brachy replay`";
  switch (wanted) {
    case FileKind::kScene:
      return "config/prostate.toml is the default one";
    case FileKind::kExercise:
      return "such as config/exercises/01_one_needle.toml";
    case FileKind::kPlan:
      return "such as config/plan.toml";
    case FileKind::kTrajectory:
      return "a CSV with t_s and a pose, such as config/insertion.csv";
    case FileKind::kMesh:
      return "an .stl, .obj or .ply";
    default:
      return "";
  }
}

}  // namespace

std::string to_string(FileKind kind) {
  constexpr std::array kNames{"a scene",         "an exercise",  "a plan of seeds", "a plan of HDR catheters",
                              "a seed source",   "a trajectory", "a surface mesh",  "a recording",
                              "an image volume", "a DICOM file"};
  return kNames[static_cast<std::size_t>(kind)];
}

std::string other_kind(const std::filesystem::path& file, FileKind wanted) {
  const std::optional<FileKind> kind = kind_of(file);
  const auto is_plan = [](FileKind k) { return k == FileKind::kPlan || k == FileKind::kHdrPlan; };
  if (!kind || *kind == wanted || (is_plan(*kind) && is_plan(wanted))) return "";
  const std::string fix = advice(file, *kind, wanted);
  return one_line(file.string()) + " is " + to_string(*kind) + "; " + to_string(wanted) +
         " is asked for here" + (fix.empty() ? "" : ": " + fix);
}

}  // namespace brachy
