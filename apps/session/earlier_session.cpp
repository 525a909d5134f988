#include "apps/session/earlier_session.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "apps/session/plan_change_log.h"
#include "apps/session/volume_study_file.h"
#include "core/base/error.h"
#include "core/brachytherapy/seeds/failed_drop_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/brachytherapy/structures/organ_pass_file.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {
namespace {

constexpr double kLongestS = 1e9;
constexpr std::size_t kTail = 16384;  // bytes, enough for two rows, which have fewer than 600
constexpr const char* kFix = "; repair it from a copy, or give another directory";
constexpr const char* kForeign = ": brachyd did not write it; remove it, or give another directory";

std::string place_of(const SessionFolder& folder, const char* name) {
  return folder.path_of(name).string();
}

std::string first_line(const SessionFolder& folder, const char* name) {
  const std::string start = folder.first_bytes(name, kTail).value_or("");
  return start.substr(0, start.find('\n'));
}

double checked_time(double t_s, const std::string& place) {
  if (std::isfinite(t_s) && t_s >= 0 && t_s <= kLongestS) return t_s;
  throw UserError(place + ": its last row's time is " + std::to_string(t_s) + kFix);
}

/// The last row of a table that begins with `header`; empty: it has none. Of a file whose only line has no end, that
/// line must be the header's beginning: else somebody else wrote it.
std::string last_row(const SessionFolder& folder, const char* name, const std::string& header,
                     const char* other_header) {
  const std::string place = place_of(folder, name);
  const std::string tail = folder.last_bytes(name, kTail).value_or("");
  const std::string_view whole = whole_lines(tail);
  const bool is_all = folder.size_of(name).value_or(0) == tail.size();
  if (whole.empty() && is_all && header.starts_with(tail)) return {};
  if (first_line(folder, name) != header) throw UserError(place + ":1: " + other_header);
  if (whole.empty()) throw UserError(place + ": its last line has no end" + kForeign);
  const std::string_view rows = whole.substr(0, whole.size() - 1);
  const std::size_t start = rows.rfind('\n');
  if (start == rows.npos && !is_all) throw UserError(place + ": its last row is too long" + kFix);
  return start == rows.npos ? std::string() : std::string(rows.substr(start + 1));
}

/// What `read` makes of the header and the last row; 0: there is none.
double end_of(const SessionFolder& folder, const char* name, const std::string& header,
              const char* other_header, const std::function<double(const std::string& text)>& read) {
  const std::string place = place_of(folder, name);
  if (folder.size_of(name).value_or(0) == 0) return 0;
  // A line that is blank is a row that brachyd did not write.
  const std::string row = last_row(folder, name, header, other_header);
  const std::string tail = folder.last_bytes(name, kTail).value_or("");
  if (row.empty() && std::ranges::count(whole_lines(tail), '\n') < 2) return 0;
  try {
    return checked_time(read(header + "\n" + row + "\n"), place);
  } catch (const UserError& error) {
    throw UserError(place + ": its last row is none that brachyd wrote (" + error.what() + ")" + kFix);
  }
}

/// The whole lines of a table; empty where it is missing, blank, or ends within its first line.
std::string table(const SessionFolder& folder, const char* name, const std::string& header) {
  if (!folder.has(name) || folder.is_blank(name)) return {};
  const std::string text = folder.read(name).value_or("");
  const std::string_view whole = whole_lines(text);
  if (whole.empty() && !header.starts_with(text))
    throw UserError(place_of(folder, name) + ":1: expected " + header + kForeign);
  return std::string(whole);
}

std::vector<std::int32_t> lost_in(const std::string& drops, const std::string& place) {
  std::vector<std::int32_t> lost;
  if (drops.empty()) return lost;
  for (const FailedDrop& drop : parse_failed_drops(drops, place))
    if (drop.why == DropRefusal::kLost && drop.planned >= 0) lost.push_back(drop.planned);
  return lost;
}

/// What belongs to a session must not be there without one: it is somebody else's.
void refuse_without_session(const SessionFolder& folder) {
  for (const SessionFile& file : kSessionFiles)
    if (folder.has(file.name) && !folder.is_blank(file.name))
      throw UserError(place_of(folder, file.name) +
                      ": is there without poses.csv, forces.csv and seeds.csv; move it away, or give another "
                      "directory: nothing is overwritten");
  if (const auto states = folder.find_folder(kStatesFolder); states && !states->names().empty())
    throw UserError(place_of(folder, kStatesFolder) +
                    ": is there without a session; move it away, or give another directory");
}

}  // namespace

EarlierSession examine_earlier_session(const SessionFolder& folder, const std::string& poses_header,
                                       std::size_t needle_count) {
  folder.check_all();
  EarlierSession earlier;
  bool is_there = false;
  std::string gaps;
  for (const char* name : {kPosesFile, kForcesFile, kSeedsFile}) {
    const bool exists = folder.has(name), blank = exists && folder.is_blank(name);
    is_there |= exists && !blank;
    if (!exists || blank)
      gaps += (gaps.empty() ? "" : ", ") + std::string(name) + (blank ? " is blank" : " is missing");
  }
  if (!is_there) {
    // A process that was killed while it began leaves the manifest alone.
    if (!folder.has(kManifestFile)) refuse_without_session(folder);
    return earlier;
  }
  earlier.missing_text = gaps;
  if (folder.has(kPosesFile) && !folder.is_blank(kPosesFile))
    earlier.end_s = end_of(folder, kPosesFile, poses_header,
                           "a recording with another number of needles; give another directory",
                           [&](const std::string& text) {
                             const NeedleTrajectories poses =
                                 parse_trajectories(text, "row", static_cast<std::uint32_t>(needle_count));
                             return poses.needles().at(0).motion.samples().at(0).t_s;
                           });
  if (folder.has(kForcesFile) && !folder.is_blank(kForcesFile)) {
    earlier.force_columns = force_columns(first_line(folder, kForcesFile)).value_or(ForceColumns::kAll);
    earlier.end_s =
        std::max(earlier.end_s,
                 end_of(folder, kForcesFile, std::string(force_log_header(earlier.force_columns)),
                        "not a force log of this version; give another directory",
                        [](const std::string& text) { return parse_force_log(text, "row").at(0).t_s; }));
  }
  const std::string seeds = table(folder, kSeedsFile, std::string(kSeedHeader));
  if (!seeds.empty()) earlier.seeds = parse_seeds(seeds, place_of(folder, kSeedsFile));
  earlier.has_unfinished_seed = folder.size_of(kSeedsFile).value_or(0) > seeds.size() &&
                                folder.has(kSeedsFile) && !folder.is_blank(kSeedsFile);
  for (const Seed& seed : earlier.seeds)
    earlier.end_s = std::max(earlier.end_s, checked_time(seed.t_s, place_of(folder, kSeedsFile)));
  earlier.lost =
      lost_in(table(folder, kDropsFile, std::string(kFailedDropHeader)), place_of(folder, kDropsFile));
  const std::string passes = table(folder, kContactsFile, std::string(kOrganPassHeader));
  if (!passes.empty()) parse_organ_passes(passes, place_of(folder, kContactsFile));
  const std::string clock = table(folder, kClockFile, std::string(kSessionClockHeader));
  if (!clock.empty()) earlier.clock = SessionClock::parse(clock, place_of(folder, kClockFile));
  const std::string studies = table(folder, kStudiesFile, "{");
  parse_studies(studies, place_of(folder, kStudiesFile));
  for (const PlanChange& change : load_plan_changes(folder))
    if (!folder.has(change.file))
      throw UserError(place_of(folder, change.file.c_str()) + ": is missing" + kFix);
  return earlier;
}

}  // namespace brachy
