#include "apps/session/session_log.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/brachytherapy/seeds/failed_drop_file.h"
#include "core/brachytherapy/structures/organ_pass_file.h"
#include "core/simulation/new_failed_drops.h"

namespace brachy {

bool SessionLog::is_recording(const std::filesystem::path& folder) {
  refuse_denied_folder(folder / kPosesFile);
  return std::ranges::any_of(kSessionFiles, [&](const SessionFile& file) {
    std::error_code ignored;
    return std::filesystem::exists(std::filesystem::symlink_status(folder / file.name, ignored));
  });
}

SessionLog::SessionLog(const std::filesystem::path& folder, std::size_t needle_count, double period_s,
                       std::optional<std::vector<std::string>> organs, Start start)
    : folder_(SessionFolder::make(folder)),
      period_s_(period_s),
      columns_{needle_count > 1, true},
      organs_(std::move(organs)) {
  folder_.lock();
  earlier_ = examine_earlier_session(folder_, trajectory_header(columns_), needle_count);
  if (!restored().empty())
    tell(std::to_string(restored().size()) + " seeds of an earlier run are in the tissue");
  if (earlier_.has_unfinished_seed) tell("an unfinished row was removed");
  if (!earlier_.missing_text.empty())
    tell("of the earlier run " + earlier_.missing_text + ": begun again, what it held is not known");
  if (start == Start::kAtOnce) begin();
}

void SessionLog::begin() {
  const auto rows_of = [&](std::optional<RowFile>& rows, const char* name, std::string_view header) {
    rows.emplace(folder_.append_to(name), folder_.path_of(name).string(), header);
    rows->flush();
    if (rows->has_failed()) throw UserError(rows->failure());
  };
  ledger_.emplace(folder_);
  forces_.emplace(folder_.append_to(kForcesFile), folder_.path_of(kForcesFile).string(),
                  earlier_.force_columns);
  rows_of(poses_, kPosesFile, trajectory_header(columns_));
  if (!organs_) return;
  rows_of(clock_, kClockFile, kSessionClockHeader);
  rows_of(drops_, kDropsFile, kFailedDropHeader);
  rows_of(contacts_, kContactsFile, kOrganPassHeader);
}

void SessionLog::tell(const std::string& what) {
  restored_text_ += (restored_text_.empty() ? "" : "; ") + what;
}

void SessionLog::add(const MeshState& state) {
  add_clock(state.summary);
  add_seeds(state.seeds.in_tissue());
  if (run_ != state.summary.run) last_contacts_.clear();
  run_ = state.summary.run;
  add_failed_drops(state.failed_drops);
  add_contacts(state);
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

// A row where the machine fell behind, and now and then.
void SessionLog::add_clock(const TickSummary& summary) {
  constexpr double kLateS = 0.05, kEveryS = 10;
  if (!clock_ || summary.publish_ns == 0) return;
  newest_s_ = time_of(summary.tick);
  if (first_publish_ns_ == 0) {
    first_publish_ns_ = summary.publish_ns;
    wall_start_s_ = earlier_.clock.wall_s(newest_s_);
    last_clock_s_ = earlier_.clock.end_s();
    last_late_s_ = wall_start_s_ - newest_s_;
  }
  newest_wall_s_ = wall_start_s_ + 1e-9 * static_cast<double>(summary.publish_ns - first_publish_ns_);
  const double late_s = newest_wall_s_ - newest_s_;
  if (std::abs(late_s - last_late_s_) < kLateS && newest_s_ < last_clock_s_ + kEveryS) return;
  if (newest_s_ <= last_clock_s_) return;
  write_clock();
}

void SessionLog::write_clock() {
  std::string row;
  append_csv_row(row, std::array{newest_s_, newest_wall_s_});
  clock_->add(row);
  last_clock_s_ = newest_s_;
  last_late_s_ = newest_wall_s_ - newest_s_;
}

// By tick, as a trajectory is sorted. A frame has all ticks since the last one, of all needles, unless that
// is too long ago.
void SessionLog::add_poses(std::vector<UsedPose> poses) {
  std::erase_if(poses, [&](const UsedPose& used) { return used.pose.tick <= last_tick_; });
  if (poses.empty()) return;
  std::ranges::stable_sort(poses, {}, [](const UsedPose& used) { return used.pose.tick; });
  const std::uint64_t first = poses.front().pose.tick, last = poses.back().pose.tick;
  write_poses(std::move(poses));
  if (last_tick_ != 0) ticks_missed_ += first - last_tick_ - 1;
  last_tick_ = last;
}

void SessionLog::add_row(const UsedPose& used) {
  poses_->add(
      trajectory_row({time_of(used.pose.tick), used.pose.X_WN, used.pose.button}, used.needle, columns_));
}

// Of a needle at rest the first row, and the last one before it moves or is gone.
void SessionLog::write_poses(std::vector<UsedPose> poses) {
  const std::uint64_t last = poses.back().pose.tick;
  std::vector<UsedPose> rows;
  const auto end_rest = [&](std::uint32_t needle) {
    LastPose& of_needle = last_poses_[needle];
    if (of_needle.resting) rows.push_back({needle, *of_needle.resting});
    of_needle.resting.reset();
  };
  for (const UsedPose& used : poses) {
    if (used.needle >= last_poses_.size()) last_poses_.resize(used.needle + std::size_t{1});
    LastPose& of_needle = last_poses_[used.needle];
    const std::optional<TickPose>& before = of_needle.resting ? of_needle.resting : of_needle.written;
    if (before && before->tick + 1 == used.pose.tick && before->button == used.pose.button &&
        before->X_WN.R == used.pose.X_WN.R && before->X_WN.p == used.pose.X_WN.p) {
      of_needle.resting = used.pose;
      continue;
    }
    end_rest(used.needle);
    of_needle.written = used.pose;
    rows.push_back(used);
  }
  for (std::uint32_t needle = 0; needle < last_poses_.size(); ++needle)
    if (last_poses_[needle].resting && last_poses_[needle].resting->tick != last) end_rest(needle);
  std::ranges::stable_sort(rows, {}, [](const UsedPose& used) { return used.pose.tick; });
  for (const UsedPose& row : rows) add_row(row);
}

void SessionLog::add_forces(std::uint64_t tick, std::uint32_t needle, const NeedleState& state,
                            double min_det) {
  forces_->add(force_sample(time_of(tick), needle, state, min_det));
}

void SessionLog::add_failed_drops(const FailedDrops& drops) {
  if (!drops_) return;
  visit_new(drops, drops_written_, [&](FailedDrop drop) {
    drop.t_s += offset_s();
    drops_->add(failed_drop_row(drop));
  });
}

void SessionLog::add_contacts(const MeshState& state) {
  const std::vector<OrganContact>& now = state.needles.organ_contacts;
  if (!contacts_ || organs_->empty() || now.empty()) return;
  last_contacts_.resize(now.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    const auto needle = static_cast<std::uint32_t>(i / organs_->size());
    const std::string& organ = (*organs_)[i % organs_->size()];
    OrganContact& last = last_contacts_[i];
    const auto add_row = [&](const OrganContact& contact, bool is_ended, std::uint64_t tick) {
      contacts_->add(organ_pass_row(pass_of(contact, organ, needle, time_of(tick), is_ended)));
    };
    const bool is_new = now[i].passes != last.passes;
    if (is_new && last.is_in) add_row(last, true, now[i].entered_tick);
    if (is_new) add_row(now[i], false, now[i].entered_tick);
    if (!now[i].is_in && (is_new || last.is_in)) add_row(now[i], true, now[i].left_tick);
    last = now[i];
  }
}

std::string SessionLog::failure() const {
  for (const RowFile* file : {&*poses_, drops_ ? &*drops_ : nullptr, contacts_ ? &*contacts_ : nullptr,
                              clock_ ? &*clock_ : nullptr})
    if (file && file->has_failed()) return file->failure();
  return forces_->failure();
}

void SessionLog::flush() {
  poses_->flush();
  forces_->flush();
  if (drops_) drops_->flush();
  if (contacts_) contacts_->flush();
  if (clock_) clock_->flush();
  if (has_reported_ || failure().empty()) return;
  has_reported_ = true;
  throw std::runtime_error(failure());
}

void SessionLog::close() {
  if (!ledger_) return;
  for (std::size_t i = 0; i < last_contacts_.size(); ++i) {
    OrganContact& contact = last_contacts_[i];
    if (!contact.is_in) continue;
    contact.is_in = false;
    contact.left_tick = last_tick_;
    contacts_->add(
        organ_pass_row(pass_of(contact, (*organs_)[i % organs_->size()],
                               static_cast<std::uint32_t>(i / organs_->size()), time_of(last_tick_), true)));
  }
  for (std::uint32_t needle = 0; needle < last_poses_.size(); ++needle)  // of one tick: the last
    if (const auto pose = std::exchange(last_poses_[needle].resting, {})) add_row({needle, *pose});
  if (first_publish_ns_ != 0 && newest_s_ > last_clock_s_) write_clock();
  poses_->flush();
  forces_->flush();
  if (drops_) drops_->flush();
  if (contacts_) contacts_->flush();
  if (clock_) clock_->flush();
  if (const std::string what = failure(); !what.empty()) throw std::runtime_error(what);
}

}  // namespace brachy
