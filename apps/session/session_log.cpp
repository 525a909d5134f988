#include "apps/session/session_log.h"

#include <algorithm>
#include <stdexcept>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
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
  rows_of(drops_, kDropsFile, kFailedDropHeader);
  rows_of(contacts_, kContactsFile, kOrganPassHeader);
}

void SessionLog::tell(const std::string& what) {
  restored_text_ += (restored_text_.empty() ? "" : "; ") + what;
}

void SessionLog::add(const MeshState& state) {
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
  for (const RowFile* file : {&*poses_, drops_ ? &*drops_ : nullptr, contacts_ ? &*contacts_ : nullptr})
    if (file && file->has_failed()) return file->failure();
  return forces_->failure();
}

void SessionLog::flush() {
  poses_->flush();
  forces_->flush();
  if (drops_) drops_->flush();
  if (contacts_) contacts_->flush();
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
  poses_->flush();
  forces_->flush();
  if (drops_) drops_->flush();
  if (contacts_) contacts_->flush();
  if (const std::string what = failure(); !what.empty()) throw std::runtime_error(what);
}

}  // namespace brachy
