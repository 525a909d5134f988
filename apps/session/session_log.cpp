#include "apps/session/session_log.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "core/base/denied_folder.h"
#include "core/base/error.h"

namespace brachy {
bool SessionLog::is_recording(const std::filesystem::path& folder) {
  refuse_denied_folder(folder / kPosesFile);
  return std::ranges::any_of(std::array{kPosesFile, kForcesFile, kSeedsFile}, [&](const char* file) {
    std::error_code ignored;
    return std::filesystem::exists(folder / file, ignored);
  });
}

SessionLog::SessionLog(const std::filesystem::path& folder, std::size_t needle_count, double period_s)
    : folder_(folder),
      period_s_(period_s),
      columns_{needle_count > 1, true},
      earlier_(examine_earlier_session(folder, trajectory_header(columns_), needle_count)),
      ledger_(folder_ / kSeedsFile),
      forces_(folder_ / kForcesFile, RowFile::Start::kSession, earlier_.force_columns),
      poses_(folder_ / kPosesFile, RowFile::Start::kSession, trajectory_header(columns_)) {
  // After the latest of the three: a run may have been killed between writing one and the other.
  offset_s_ = std::max(earlier_.end_s, latest_seed_s(ledger_.restored(), folder_ / kSeedsFile));
  poses_.flush();
  if (poses_.has_failed()) throw UserError(poses_.failure());
  if (!ledger_.restored().empty())
    tell(std::to_string(ledger_.restored().size()) + " seeds of an earlier run are in the tissue");
  if (ledger_.had_partial_row()) tell("an unfinished row was removed");
  if (!earlier_.missing_text.empty())
    tell("of the earlier run " + earlier_.missing_text + ": begun again, what it held is not known");
}

void SessionLog::tell(const std::string& what) {
  restored_text_ += (restored_text_.empty() ? "" : "; ") + what;
}

void SessionLog::add(const MeshState& state) {
  add_seeds(state.seeds.in_tissue());
  constexpr std::uint64_t kRing = NeedleStates::kPoseHistory;
  const std::uint64_t newest = state.summary.tick;
  const std::uint64_t oldest = std::max(last_tick_ + 1, newest < kRing ? 1 : newest - kRing + 1);
  std::vector<UsedPose> used;
  for (std::uint32_t n = 0; n < state.needles.states.size(); ++n) {
    const NeedleState& needle = state.needles.states[n];
    for (std::uint64_t tick = oldest; tick <= newest; ++tick)
      if (const TickPose& pose = state.needles.pose_histories[n][tick % kRing]; pose.tick == tick)
        used.push_back({n, pose});
    if (needle.present) add_forces(newest, n, needle, state.summary.certificate.vertex_det);
  }
  add_poses(std::move(used));
}

// By tick, as a trajectory is sorted. A frame has all ticks since the last one, of all needles, unless that
// is too long ago.
void SessionLog::add_poses(std::vector<UsedPose> poses) {
  std::erase_if(poses, [&](const UsedPose& used) { return used.pose.tick <= last_tick_; });
  if (poses.empty()) return;
  std::ranges::stable_sort(poses, {}, [](const UsedPose& used) { return used.pose.tick; });
  for (const auto& [needle, pose] : poses)
    poses_.add(trajectory_row({time_of(pose.tick), pose.X_WN, pose.button}, needle, columns_));
  if (last_tick_ != 0) ticks_missed_ += poses.front().pose.tick - last_tick_ - 1;
  last_tick_ = poses.back().pose.tick;
}

void SessionLog::add_forces(std::uint64_t tick, std::uint32_t needle, const NeedleState& state,
                            double min_det) {
  forces_.add(force_sample(time_of(tick), needle, state, min_det));
}

std::string SessionLog::failure() const {
  return poses_.has_failed() ? poses_.failure() : forces_.failure();
}

void SessionLog::flush() {
  poses_.flush();
  forces_.flush();
  if (has_reported_ || failure().empty()) return;
  has_reported_ = true;
  throw std::runtime_error(failure());
}

void SessionLog::close() {
  poses_.flush();
  forces_.flush();
  if (const std::string what = failure(); !what.empty()) throw std::runtime_error(what);
}

}  // namespace brachy
