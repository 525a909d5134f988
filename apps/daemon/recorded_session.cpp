#include "apps/daemon/recorded_session.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include "apps/score/report.h"
#include "core/base/error.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

/// An existing directory must stay writable after root's rights over other users' files have been dropped.
const std::filesystem::path& checked(const std::filesystem::path& folder) {
  struct stat about {};
  if (::stat(folder.c_str(), &about) == 0 && ::geteuid() == 0 && about.st_uid != 0 &&
      (about.st_mode & S_IWOTH) == 0)
    throw UserError(
        folder.string() +
        ": belongs to another user, and brachyd drops root's rights over other users' files once it runs; "
        "start it as that user, or give a directory that root owns");
  return folder;
}

}  // namespace

RecordedSession::RecordedSession(const std::filesystem::path& folder, const Scene& scene,
                                 std::optional<Plan> plan, std::vector<std::string> organs)
    : folder_(checked(folder)),
      scene_(scene),
      plan_(std::move(plan)),
      log_(folder, scene.instrument_count(), scene.period_s(), std::move(organs)) {
  if (!log_.restored_text().empty()) spdlog::info("session {}: {}", folder.string(), log_.restored_text());
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
    append_study(folder_, study);
  } catch (const std::exception& e) {
    return std::string("session: ") + e.what();
  }
  return {};
}

Score RecordedSession::score() const {
  if (!plan_) throw UserError("the scene has no plan to score against: give it plan.file");
  return score_recording(folder_, *plan_, scene_, load_structures(scene_));
}

std::string RecordedSession::end(const Exercise* exercise) {
  try {
    log_.close();
  } catch (const std::runtime_error& e) {
    failure_ = e.what();
  }
  if (!failure_.empty()) spdlog::error("session: {}", failure_);
  std::string kept = fmt::format("{}: {} seeds, {} poses", folder_.string(), log_.seeds(), log_.poses());
  if (!plan_) return kept;
  const std::filesystem::path page = folder_ / "report.html";
  try {
    const Score score = write_report(folder_, *plan_, scene_, page);
    const std::string text = (exercise ? to_text(*exercise, judge(*exercise, score)) : "") + to_text(score);
    for (const char* extension : {".html", ".json"}) {
      std::error_code ignored;
      const std::filesystem::path file = std::filesystem::path(page).replace_extension(extension);
      std::filesystem::permissions(
          file, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write, ignored);
    }
    return kept + "\n" + text + page.string();
  } catch (const std::exception& e) {  // the recording is complete all the same, for `brachy score`
    spdlog::error("session: no report: {}", e.what());
    return kept;
  }
}

}  // namespace brachy
