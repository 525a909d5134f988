#include "apps/session/session_manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <span>

#include "apps/session/sha256.h"
#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/base/version.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/geometry/volume/file_bytes.h"
#include "core/scene/choose_source.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;
using OrderedJson = nlohmann::ordered_json;

constexpr const char* kFormat = "brachyd session 1";
constexpr std::size_t kMostTextBytes = std::size_t{1} << 20;  // as scenes and plans may have
constexpr std::size_t kMostListed = 3;

/// Sections that neither what happens in a session nor its score depends on.
constexpr std::array kService = {"",       "ultrasound", "engine",  "work_costs", "realtime",
                                 "device", "server",     "display", "broker"};
/// Sections that only the score depends on.
constexpr std::array kJudgement = {"dose", "goal"};
/// Keys that name files: their content is compared. And the rate of the display.
constexpr std::array kNotCompared = {"tissue.mesh", "plan.file",         "implant.seeds",
                                     "dose.source", "rates.snapshot_hz", "tissue.colour"};

bool is_among(std::span<const char* const> names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

/// Files that the scene names, besides the plan.
std::vector<SessionManifest::File> files_of(const Scene& scene) {
  std::vector<SessionManifest::File> files;
  const auto add = [&](const std::string& key, const std::string& name) {
    if (name.empty()) return;
    const FileDigest digest = digest_of_file(scene.resolve(name));
    files.push_back({key, name, digest.sha256, digest.bytes});
  };
  add("tissue.mesh", scene.tissue.mesh);
  for (std::size_t r = 0; r < scene.regions.size(); ++r)
    add(fmt::format("region {}", r + 1), scene.regions[r].file);
  for (const StructureSettings& structure : scene.structures)
    add("structure " + structure.name, structure.file);
  add("implant.seeds", scene.implant.seeds);
  if (!scene.dose.source.empty() && !find_source(scene.dose.source)) add("dose.source", scene.dose.source);
  return files;
}

std::optional<ManifestText> plan_text_of(const Scene& scene) {
  if (scene.plan_file.empty()) return std::nullopt;
  return ManifestText{scene.plan_file, file_bytes(scene.resolve(scene.plan_file), kMostTextBytes)};
}

OrderedJson to_json(const ManifestText& text) {
  return {{"file", text.file}, {"sha256", sha256_of(text.text)}, {"text", text.text}};
}

OrderedJson to_json(const std::optional<ManifestText>& text) {
  return text ? to_json(*text) : OrderedJson();
}

ManifestText text_from(const OrderedJson& json, const std::string& place) {
  ManifestText text{json.at("file").get<std::string>(), json.at("text").get<std::string>()};
  if (sha256_of(text.text) != json.at("sha256").get<std::string>())
    throw UserError(place + ": the text of " + one_short_line(text.file) +
                    " is not the one whose hash stands beside it: was it edited? Restore it from a copy");
  return text;
}

std::optional<ManifestText> text_if_there(const OrderedJson& json, const std::string& place) {
  return json.is_null() ? std::optional<ManifestText>() : text_from(json, place);
}

std::string text_or_empty(const OrderedJson& json) {
  return json.is_null() ? std::string() : json.get<std::string>();
}

OrderedJson text_or_null(const std::string& text) {
  return text.empty() ? OrderedJson() : OrderedJson(text);
}

/// Without the files that it names.
Scene parse_own_scene(const SessionManifest& manifest) {
  if (manifest.scene.file.empty()) return {};
  Scene scene = parse_scene(manifest.scene.text, manifest.scene.file);
  scene.directory = fs::path(manifest.scene.file).parent_path();
  return scene;
}

void compare_key(const Key<Scene>& key, const std::string& name, const Scene& own, const Scene& other,
                 std::vector<std::string>& differences) {
  if (key.is_same(own, other) || is_among(kNotCompared, name)) return;
  const std::string was = key.written ? key.written(own) : "", is = key.written ? key.written(other) : "";
  differences.push_back(was == is ? name + " is another"
                                  : fmt::format("{} was {}, not {}", name, was.empty() ? "open" : was,
                                                is.empty() ? "open" : is));
}

void compare_files(const std::vector<SessionManifest::File>& own,
                   const std::vector<SessionManifest::File>& other, std::vector<std::string>& differences) {
  const auto find = [](const auto& files, const std::string& key) {
    return std::ranges::find(files, key, &SessionManifest::File::key);
  };
  for (const SessionManifest::File& file : own) {
    const auto same = find(other, file.key);
    if (same == other.end())
      differences.push_back(file.key + " was " + file.file + ", and here is none");
    else if (same->sha256 != file.sha256)
      differences.push_back(
          fmt::format("{}: {} has another content than {} had", file.key, same->file, file.file));
  }
  for (const SessionManifest::File& file : other)
    if (find(own, file.key) == own.end())
      differences.push_back(file.key + " was none, and here is " + file.file);
}

/// Plans are compared by their text, without comments and blanks at the ends of lines.
std::string bare(const std::string& text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = std::string_view(text).substr(at, end - at);
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.remove_suffix(1);
    if (!line.empty() && line.front() != '#') (result += line) += '\n';
    at = end + 1;
  }
  return result;
}

}  // namespace

SessionManifest make_manifest(const Scene& scene, const std::optional<fs::path>& file) {
  SessionManifest manifest;
  if (file) {
    const fs::path absolute = fs::absolute(*file).lexically_normal();
    manifest.scene = {absolute.string(), file_bytes(absolute, kMostTextBytes)};
  }
  manifest.plan = plan_text_of(scene);
  manifest.kernel = scene.model.kernel;
  manifest.files = files_of(scene);
  manifest.version = version();
  return manifest;
}

std::string to_json(const SessionManifest& manifest) {
  OrderedJson json = {{"format", kFormat},
                      {"version", manifest.version},
                      {"trainee", text_or_null(manifest.trainee)},
                      {"frame", "patient RAS, mm"},
                      {"kernel", manifest.kernel},
                      {"scene", manifest.scene.file.empty() ? OrderedJson() : to_json(manifest.scene)},
                      {"plan", to_json(manifest.plan)},
                      {"exercise", to_json(manifest.exercise)},
                      {"files", OrderedJson::array()},
                      {"runs", OrderedJson::array()}};
  for (const SessionManifest::File& file : manifest.files)
    json["files"].push_back(
        {{"key", file.key}, {"file", file.file}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  for (const SessionManifest::Run& run : manifest.runs)
    json["runs"].push_back({{"version", run.version},
                            {"from_s", run.from_s},
                            {"began", run.began},
                            {"ended", text_or_null(run.ended)}});
  return json.dump(1, ' ', false, OrderedJson::error_handler_t::replace) + "\n";
}

SessionManifest parse_manifest(std::string_view text, const std::string& name) {
  SessionManifest manifest;
  try {
    const OrderedJson json = OrderedJson::parse(text);
    if (json.at("format") != kFormat)
      throw UserError(name + ": is of another version of brachyd (" +
                      one_short_line(json.at("format").get<std::string>()) + "); use that one");
    manifest.version = json.at("version").get<std::string>();
    manifest.trainee = text_or_empty(json.at("trainee"));
    manifest.kernel = json.at("kernel").get<std::string>();
    manifest.scene = text_if_there(json.at("scene"), name).value_or(ManifestText());
    manifest.plan = text_if_there(json.at("plan"), name);
    manifest.exercise = text_if_there(json.at("exercise"), name);
    for (const OrderedJson& file : json.at("files"))
      manifest.files.push_back({file.at("key").get<std::string>(), file.at("file").get<std::string>(),
                                file.at("sha256").get<std::string>(), file.at("bytes").get<std::uint64_t>()});
    for (const OrderedJson& run : json.at("runs"))
      manifest.runs.push_back({run.at("version").get<std::string>(), run.at("began").get<std::string>(),
                               text_or_empty(run.at("ended")), run.at("from_s").get<double>()});
  } catch (const nlohmann::json::exception&) {
    throw UserError(
        name +
        ": is no description of a session that brachyd wrote; restore it from a copy, or remove it: "
        "then the session is taken as one of before there were any");
  }
  return manifest;
}

std::optional<SessionManifest> load_manifest(const SessionFolder& folder) {
  const std::optional<std::string> text = folder.read(kManifestFile);
  if (!text) return std::nullopt;
  return parse_manifest(*text, folder.path_of(kManifestFile).string());
}

Scene scene_of(const SessionManifest& manifest, const std::string& session) {
  Scene scene = parse_own_scene(manifest);
  std::vector<std::string> differences;
  try {
    choose_source(scene);
    compare_files(manifest.files, files_of(scene), differences);
  } catch (const UserError& e) {
    throw UserError(session + ": its scene " + manifest.scene.file + " cannot be used as it was: " +
                    e.what() + "; give the same scene, wherever it is now, with --config");
  }
  if (!differences.empty())
    throw UserError(session + ": its scene " + manifest.scene.file + " has changed since: " +
                    listed_differences(differences) + "; restore it, or give the same scene with --config");
  return scene;
}

std::vector<std::string> differences_from(const SessionManifest& manifest, const Scene& scene,
                                          ManifestScope scope) {
  std::vector<std::string> differences;
  Scene own = parse_own_scene(manifest);
  // Where another key names the source (choose_source), that one is compared, and the source's file with the files.
  const auto is_named = [](const Scene& s) { return s.implant.is_hdr() || !s.dose.source.empty(); };
  if (is_named(own) && is_named(scene)) own.seeds.source = scene.seeds.source;
  for (const SceneSection& section : scene_sections()) {
    const std::string_view name = section.name;
    if (is_among(kService, name) || (scope == ManifestScope::kRecorded && is_among(kJudgement, name)))
      continue;
    if (name == "structure") continue;  // by the content of its files
    if (section.list) {
      if (!section.list->whole.is_same(own, scene))
        differences.push_back(fmt::format("[[{}]] is another", name));
      continue;
    }
    for (const Key<Scene>& key : section.keys)
      compare_key(key, fmt::format("{}.{}", name, key.name), own, scene, differences);
  }
  compare_files(manifest.files, files_of(scene), differences);
  const std::optional<ManifestText> plan = plan_text_of(scene);
  const std::string was = manifest.plan ? bare(manifest.plan->text) : "", is = plan ? bare(plan->text) : "";
  if (was != is)
    differences.push_back(was.empty()  ? "it had no plan"
                          : is.empty() ? "its plan is missing"
                                       : "the plan is another");
  return differences;
}

std::string listed_differences(const std::vector<std::string>& differences) {
  std::string text;
  for (std::size_t i = 0; i < std::min(differences.size(), kMostListed); ++i)
    text += (i == 0 ? "" : "; ") + one_short_line(differences[i], 200);
  if (differences.size() > kMostListed)
    text += fmt::format("; and {} more", differences.size() - kMostListed);
  return text;
}

std::optional<Plan> plan_of(const SessionManifest& manifest, const Scene& scene) {
  if (!manifest.plan || scene.implant.is_hdr()) return std::nullopt;
  const auto& [file, text] = *manifest.plan;
  const auto parse = fs::path(file).extension() == ".csv" ? &parse_plan_csv : &parse_plan_toml;
  return parse(text, file, scene.template_grid, scene.needle.length_mm);
}

std::optional<HdrPlan> hdr_plan_of(const SessionManifest& manifest, const Scene& scene) {
  if (!manifest.plan || !scene.implant.is_hdr()) return std::nullopt;
  return parse_hdr_plan(manifest.plan->text, manifest.plan->file, scene.template_grid,
                        scene.needle.length_mm);
}

SessionScene load_scene_for(const fs::path& file, const std::optional<fs::path>& config, bool what_if) {
  const fs::path beside = file.has_parent_path() ? file.parent_path() : fs::path(".");
  std::error_code ignored;
  std::optional<SessionManifest> manifest;
  if (fs::is_directory(beside, ignored)) manifest = load_manifest(SessionFolder::open(beside));
  if (!config) {
    if (!manifest) return {};
    Scene own = scene_of(*manifest, beside.string());
    // What is simulated again depends on the plan too.
    if (const std::vector<std::string> changes = differences_from(*manifest, own, ManifestScope::kRecorded);
        !changes.empty())
      throw UserError(fmt::format(
          "{}: its scene {} is not as it was: {}; restore it, or give the same scene with --config",
          beside.string(), manifest->scene.file, listed_differences(changes)));
    return {std::move(own), std::move(manifest)};
  }
  Scene scene = load_scene(*config);
  if (!manifest || what_if) return {std::move(scene), std::nullopt};
  const std::vector<std::string> differences = differences_from(*manifest, scene, ManifestScope::kRecorded);
  if (!differences.empty())
    throw UserError(
        fmt::format("{}: is of a session of another scene than {}: {}; leave out --config for the session's "
                    "own, or add --what-if",
                    file.string(), config->string(), listed_differences(differences)));
  return {std::move(scene), std::move(manifest)};
}

}  // namespace brachy
