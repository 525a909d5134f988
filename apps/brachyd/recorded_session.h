#pragma once

#include <optional>
#include <string>

#include "apps/session/session_log.h"
#include "core/plan/plan.h"
#include "core/scene/scene.h"

namespace brachy {

/// The session that a daemon records where it was asked to: a SessionLog whose failures are told and end nothing, and the
/// report when it is over.
/// Threads: one at a time; sync() any other.
class RecordedSession {
 public:
  /// Throws UserError as SessionLog does.
  RecordedSession(const std::filesystem::path& folder, const Scene& scene, std::optional<Plan> plan);

  const std::vector<Seed>& restored() const { return log_.restored(); }

  /// Writes what is new in `state`. The text of a failure, once, which is logged too; seeds are tried again next
  /// time.
  std::optional<std::string> keep(const MeshState& state);
  void sync() const noexcept { log_.sync_seeds(); }

  /// Closes the files and, with a plan, writes report.html and report.json. What became of it, for people.
  std::string end();

 private:
  std::filesystem::path folder_;
  Scene scene_;
  std::optional<Plan> plan_;
  SessionLog log_;
  std::string failure_;
};

}  // namespace brachy
