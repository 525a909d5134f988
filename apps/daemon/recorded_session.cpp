#include "apps/daemon/recorded_session.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <array>
#include <ctime>

#include "apps/score/hdr_report.h"
#include "apps/score/report.h"
#include "core/base/error.h"
#include "core/base/version.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

/// "2026-11-28T09:30:00Z".
std::string utc_text(std::int64_t utc_ns) {
  const std::time_t seconds = utc_ns / 1'000'000'000;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts)};
}

std::string plan_text(const std::optional<ManifestText>& plan) {
  return plan ? plan->text : std::string();
}

}  // namespace

RecordedSession::RecordedSession(const std::filesystem::path& folder, const Scene& scene, SessionPlan plan,
                                 std::vector<std::string> organs)
    : scene_(scene),
      plan_(std::move(plan)),
      log_(folder, scene.instrument_count(), scene.period_s(), std::move(organs), SessionLog::Start::kLater) {
  if (!log_.restored_text().empty()) spdlog::info("session {}: {}", folder.string(), log_.restored_text());
}

void RecordedSession::begin(SessionManifest manifest, std::int64_t utc_ns) {
  const SessionFolder& folder = log_.folder();
  const auto refuse = [&](const std::string& why) {
    throw UserError(folder.path().string() + ": holds a session " + why +
                    "; give another directory, or what it was begun with");
  };
  if (std::optional<SessionManifest> earlier = load_manifest(folder)) {
    // A scene that is in no file has no text to compare, but a plan.
    if (manifest.scene.file.empty() && earlier->scene.file.empty()) {
      if (plan_text(manifest.plan) != plan_text(earlier->plan)) refuse("of another plan");
    } else {
      const auto differences =
          differences_from(*earlier, scene_of(manifest, folder.path().string()), ManifestScope::kRecorded);
      if (!differences.empty()) refuse("of another scene: " + listed_differences(differences));
    }
    if (earlier->kernel != manifest.kernel)
      refuse("of model " + earlier->kernel + ", and \"auto\" chooses " + manifest.kernel + " now");
    if (!manifest.trainee.empty() && manifest.trainee != earlier->trainee)
      refuse(earlier->trainee.empty() ? "of no named trainee" : "of trainee " + earlier->trainee);
    manifest = std::move(*earlier);
  }
  manifest.runs.push_back({version(), utc_text(utc_ns), {}, start_s()});
  manifest_ = std::move(manifest);
  folder.replace(kManifestFile, to_json(manifest_));
  log_.begin();
}

std::optional<std::string> RecordedSession::record(const MeshState& state, const SavedTick* saved) {
  try {
    log_.add(state);
    if (saved) log_.add_state(saved->tick, saved->bytes);
    log_.flush();
  } catch (const std::runtime_error& e) {
    if (failure_ == e.what()) return std::nullopt;
    failure_ = e.what();
    spdlog::error("session: {}", failure_);
    return "session: " + failure_;
  }
  return std::nullopt;
}

std::string RecordedSession::store(RecordedStudy study) const {
  study.t_s += log_.offset_s();
  try {
    append_study(log_.folder(), study);
  } catch (const std::exception& e) {
    return std::string("session: ") + e.what();
  }
  return {};
}

void RecordedSession::keep(std::vector<CatheterCourse> catheters) {
  catheters_.writer.slot() = std::move(catheters);
  catheters_.writer.publish();
}

void RecordedSession::write_catheters() const {
  catheters_.reader.update();
  if (const auto& catheters = catheters_.reader.value())
    log_.folder().replace(kCatheterFile, to_csv(*catheters));
}

ScoredSession RecordedSession::score() const {
  const std::filesystem::path& folder = log_.folder().path();
  if (plan_.fraction) {
    write_catheters();
    FractionReport report = make_fraction_report(folder, *plan_.fraction, scene_);
    return {std::move(report.score), std::move(report.html)};
  }
  if (!plan_.seeds) throw UserError("the scene has no plan to score against: give it plan.file");
  Report report = make_report(folder, *plan_.seeds, scene_);
  return {std::move(report.score), std::move(report.html)};
}

std::string RecordedSession::end(const Exercise* exercise, std::int64_t utc_ns) {
  const SessionFolder& folder = log_.folder();
  try {
    log_.close();
    manifest_.runs.at(manifest_.runs.size() - 1).ended = utc_text(utc_ns);
    folder.replace(kManifestFile, to_json(manifest_));
  } catch (const std::runtime_error& e) {
    failure_ = e.what();
  }
  if (!failure_.empty()) spdlog::error("session: {}", failure_);
  std::string kept =
      fmt::format("{}: {} seeds, {} poses", folder.path().string(), log_.seeds(), log_.poses());
  const auto told = [&](const auto& report, const std::string& text) {
    keep_report(folder, report, EarlierReport::kReplaced);
    const std::string result = report.score.exercise ? to_text(*report.score.exercise) : "";
    return kept + "\n" + result + text + folder.path_of(kReportPage).string();
  };
  ReportOptions options;
  if (exercise) options.exercise = *exercise;
  try {
    if (plan_.fraction) {
      write_catheters();
      const FractionReport report = make_fraction_report(folder.path(), *plan_.fraction, scene_, options);
      return told(report, to_text(report));
    }
    if (!plan_.seeds) return kept;
    const Report report = make_report(folder.path(), *plan_.seeds, scene_, {}, options);
    return told(report, to_text(report.score));
  } catch (const std::exception& e) {  // the recording is complete all the same, for `brachy score`
    spdlog::error("session: no report: {}", e.what());
    return kept;
  }
}

}  // namespace brachy
