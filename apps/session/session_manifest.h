#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/session/session_folder.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/scene/scene.h"

namespace brachy {

/// A file's whole text, by the name under which it was given.
struct ManifestText {
  std::string file, text;
  bool operator==(const ManifestText&) const = default;
};

/// What a session was: session.json in its directory, a JSON object. Texts are whole, larger files by SHA-256.
struct SessionManifest {
  /// A file that the scene names, besides the plan: "tissue.mesh", "structure rectum", …
  struct File {
    std::string key, file, sha256;
    std::uint64_t bytes = 0;
    bool operator==(const File&) const = default;
  };
  /// One run of the daemon.
  struct Run {
    std::string version;
    std::string began, ended;  ///< UTC, "2026-11-28T09:30:00Z"; ended empty: it was killed
    double from_s = 0;         ///< of the session's time; > 0 in the first: what was before had no manifest
    bool operator==(const Run&) const = default;
  };

  std::string trainee;                   ///< as given; empty: not given
  ManifestText scene;                    ///< its absolute path; both empty: the built-in phantom
  std::optional<ManifestText> plan;      ///< the scene's, at the session's start
  std::optional<ManifestText> exercise;  ///< whose scene it was
  std::string kernel;                    ///< of the model, as used where the scene says auto
  std::vector<File> files;
  std::vector<Run>
      runs;  ///< empty: computed offline, where there is no wall time, so that the same bytes come twice
  std::string version;  ///< of the program that made it

  bool operator==(const SessionManifest&) const = default;
};

/// Of a scene as it is used now. `file`: the scene's; nullopt: the built-in phantom. Throws UserError where a file
/// cannot be read.
SessionManifest make_manifest(const Scene& scene, const std::optional<std::filesystem::path>& file);

std::string to_json(const SessionManifest& manifest);
/// Throws UserError "name: what; fix".
SessionManifest parse_manifest(std::string_view text, const std::string& name);
/// Of a session's directory; nullopt: it was recorded before there were manifests, or by `brachy record`.
std::optional<SessionManifest> load_manifest(const SessionFolder& folder);

/// The session's own scene, from its text. Throws UserError where a file that it names is not there any more or is
/// another; the plan as it is there now does not matter. `session`: for messages.
Scene scene_of(const SessionManifest& manifest, const std::string& session);

/// In what a scene differs from the session's, a phrase each; empty: it is the same task. kRecorded: what the session
/// recorded depends on, which is tissue, model, needle, template, structures and plan. kJudged: what its score depends
/// on too, which is goals and dose. Server, rates of display, engine and devices never matter.
enum class ManifestScope { kRecorded, kJudged };
std::vector<std::string> differences_from(const SessionManifest& manifest, const Scene& scene,
                                          ManifestScope scope);

/// "A; B and 3 more" of differences.
std::string listed_differences(const std::vector<std::string>& differences);

/// The session's plan, from its text, for its scene; nullopt: it had none, or one of the other kind.
std::optional<Plan> plan_of(const SessionManifest& manifest, const Scene& scene);
std::optional<HdrPlan> hdr_plan_of(const SessionManifest& manifest, const Scene& scene);

/// A session's scene, and what it was; nullopt: the file is no session's, or one's of before there were manifests.
struct SessionScene {
  Scene scene;
  std::optional<SessionManifest> manifest;
};

/// The scene for a tool that works on a file which may be a session's (its poses, its seeds): that of `config`, else
/// the session's own where `file` lies beside a manifest, else the built-in phantom. Throws UserError where `config`
/// is not the session's, unless `what_if`.
SessionScene load_scene_for(const std::filesystem::path& file,
                            const std::optional<std::filesystem::path>& config, bool what_if);

}  // namespace brachy
