#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/daemon/exercise/exercise_pages.h"
#include "apps/daemon/loops/saved_tick.h"
#include "apps/score/exercise.h"
#include "apps/session/session_log.h"
#include "apps/session/session_manifest.h"
#include "apps/session/volume_study_file.h"
#include "core/brachytherapy/hdr/catheter_course.h"
#include "core/brachytherapy/hdr/hdr_plan.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/realtime/hand_over.h"
#include "core/scene/scene.h"

namespace brachy {

/// What a session is scored against: seeds, a fraction's catheters, or nothing.
struct SessionPlan {
  std::optional<Plan> seeds;
  std::optional<HdrPlan> fraction;
};

/// The session that the daemon records (--session): a SessionLog whose failures are reported without ending
/// the daemon, and the report at the end.
/// Threads: one at a time; sync() and keep() others.
class RecordedSession {
 public:
  /// Examines the directory, as SessionLog does with Start::kLater.
  /// `organs`: names of SimulationModel::organs.
  RecordedSession(const std::filesystem::path& folder, const Scene& scene, SessionPlan plan,
                  std::vector<std::string> organs);

  const std::vector<Seed>& restored() const { return log_.restored(); }
  const std::vector<std::int32_t>& restored_lost() const { return log_.restored_lost(); }

  const SessionFolder& folder() const { return log_.folder(); }
  /// Begins to record: nothing in the directory has changed before. `manifest`: of the scene, without its runs. Throws
  /// UserError where the directory holds a session of another scene or trainee: then nothing has changed either.
  void begin(SessionManifest manifest, std::int64_t utc_ns);
  double start_s() const { return log_.offset_s(); }  ///< session time of tick 0

  /// Writes what is new in `state`, and keeps `saved` unless it is null. Returns and logs the text of a failure, once;
  /// seeds are retried at the next call.
  std::optional<std::string> record(const MeshState& state, const SavedTick* saved = nullptr);
  void sync() const noexcept { log_.sync_seeds(); }

  /// The catheters that lie in the patient, of a fraction: score() and end() write them as catheters.csv.
  /// Threads: any one.
  void keep(std::vector<CatheterCourse> catheters);

  /// Appends a study, whose time is that of this run. Returns the text of a failure, else "".
  /// Threads: one at a time; not that of record().
  std::string store(RecordedStudy study) const;

  /// Scores what has been recorded so far, for a report; takes up to seconds. Throws UserError, also without a plan.
  /// Threads: any, one at a time, also while another records.
  ScoredSession score() const;

  /// Closes the files and, with a plan, writes report.html and report.json, of a fraction hdr_report.json. Returns a
  /// summary for the operator, with the result of `exercise` unless it is null.
  std::string end(const Exercise* exercise, std::int64_t utc_ns);

 private:
  void write_catheters() const;

  const Scene scene_;
  const SessionPlan plan_;
  SessionLog log_;
  SessionManifest manifest_;
  std::string failure_;
  mutable HandOver<std::optional<std::vector<CatheterCourse>>> catheters_;  // from keep(); none: not known
};

}  // namespace brachy
