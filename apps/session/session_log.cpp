#include "apps/session/session_log.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <stdexcept>

#include "apps/session/whole_lines.h"
#include "core/base/error.h"

namespace brachy {
namespace {

constexpr const char *kPoses = "poses.csv", *kForces = "forces.csv", *kSeeds = "seeds.csv";

std::filesystem::path made(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw UserError(folder.string() + ": cannot be created: " + error.message());
  return folder;
}

/// The forces of an earlier run stay where they are.
ForceLogWriter open_forces(const std::filesystem::path& file) {
  if (std::filesystem::exists(file)) truncate_partial_line(file);
  return ForceLogWriter(file, RowFile::Start::kGoOn);
}

std::string first_line(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  std::getline(in, line);
  return line;
}

}  // namespace

bool SessionLog::is_recording(const std::filesystem::path& folder) {
  return std::ranges::any_of(std::array{kPoses, kForces, kSeeds},
                             [&](const char* file) { return std::filesystem::exists(folder / file); });
}

SessionLog::SessionLog(const std::filesystem::path& folder, std::size_t needle_count, double period_s)
    : folder_(made(folder)),
      period_s_(period_s),
      columns_{needle_count > 1, true},
      ledger_(folder_ / kSeeds),
      forces_(open_forces(folder_ / kForces)) {
  open_poses();
  if (!ledger_.restored().empty())
    restored_text_ = std::to_string(ledger_.restored().size()) + " seeds of an earlier run are in the tissue";
  if (ledger_.had_partial_row())
    restored_text_ += (restored_text_.empty() ? "" : "; ") + std::string("an unfinished row was removed");
}

void SessionLog::open_poses() {
  const std::filesystem::path file = folder_ / kPoses;
  const std::string header = trajectory_header(columns_);
  const bool is_continued = std::filesystem::exists(file) && std::filesystem::file_size(file) > 0;
  if (is_continued) {
    truncate_partial_line(file);
    if (first_line(file) != header)
      throw UserError(file.string() +
                      ":1: a recording with another number of needles; give another directory");
    const std::string row = last_line(file);
    double last_s = 0;
    if (std::from_chars(row.data(), row.data() + row.size(), last_s).ec == std::errc()) offset_s_ = last_s;
  }
  poses_.emplace(file, RowFile::Start::kGoOn, header);
  poses_->flush();
  if (poses_->has_failed()) throw UserError(poses_->failure());
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
    poses_->add(trajectory_row({time_of(pose.tick), pose.X_WN, pose.button}, needle, columns_));
  if (last_tick_ != 0) ticks_missed_ += poses.front().pose.tick - last_tick_ - 1;
  last_tick_ = poses.back().pose.tick;
}

void SessionLog::add_forces(std::uint64_t tick, std::uint32_t needle, const NeedleState& state,
                            double min_det) {
  forces_.add(force_sample(time_of(tick), needle, state, min_det));
}

std::string SessionLog::failure() const {
  return poses_->has_failed() ? poses_->failure() : forces_.failure();
}

void SessionLog::flush() {
  poses_->flush();
  forces_.flush();
  if (has_reported_ || failure().empty()) return;
  has_reported_ = true;
  throw std::runtime_error(failure());
}

void SessionLog::close() {
  poses_->flush();
  forces_.flush();
  if (const std::string what = failure(); !what.empty()) throw std::runtime_error(what);
}

}  // namespace brachy
