#include "apps/session/plan_change_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "apps/forces/row_file.h"
#include "apps/session/whole_lines.h"
#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/brachytherapy/plan/plan_file.h"

namespace brachy {
namespace {

/// Of a table without kinds.
PlanChangeKind kind_told_by(const std::string& what) {
  return what.starts_with(to_string(PlanChangeKind::kOptimised)) ? PlanChangeKind::kOptimised
                                                                 : PlanChangeKind::kEdited;
}

std::optional<PlanChangeKind> find_kind(std::string_view text) {
  for (const PlanChangeKind kind : {PlanChangeKind::kOptimised, PlanChangeKind::kEdited})
    if (text == to_string(kind)) return kind;
  return std::nullopt;
}

PlanChange parse_plan_change(std::string_view line, bool has_kind, const std::string& place) {
  const auto cell = [&] {  // up to a comma that must be there
    const std::size_t end = line.find(',');
    if (end == line.npos)
      throw UserError(place + ": is no change of a plan; expected " +
                      (has_kind ? kPlanChangesHeader : kPlanChangesWithoutKindHeader));
    const std::string_view text = line.substr(0, end);
    line.remove_prefix(end + 1);
    return text;
  };
  PlanChange change;
  const std::string_view time = cell();
  const auto [end, error] = std::from_chars(time.data(), time.data() + time.size(), change.t_s);
  if (error != std::errc() || end != time.data() + time.size())
    throw UserError(place + ": t_s is not a number; was the table edited?");
  change.file = cell();
  if (change.file.empty() || change.file.find('/') != std::string::npos)
    throw UserError(place + ": file is no name of a plan in the session's directory; was the table edited?");
  std::optional<PlanChangeKind> kind;
  if (has_kind && !(kind = find_kind(cell())))
    throw UserError(place + ": kind is neither optimised nor edited; was the table edited?");
  change.what = line;
  change.kind = kind ? *kind : kind_told_by(change.what);
  return change;
}

struct ChangeTable {
  bool has_kinds = true;
  std::vector<PlanChange> changes;
};

ChangeTable load_table(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kPlanChangesFile;
  ChangeTable table;
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return table;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream content;
  if (!(content << in.rdbuf())) throw UserError(file.string() + ": cannot be read");
  std::istringstream lines(content.str().substr(0, content.str().rfind('\n') + 1));
  std::string line;
  for (std::size_t n = 1; std::getline(lines, line); ++n) {
    const std::string place = file.string() + ":" + std::to_string(n);
    if (n > 1)
      table.changes.push_back(parse_plan_change(line, table.has_kinds, place));
    else if (line == kPlanChangesWithoutKindHeader)
      table.has_kinds = false;
    else if (line != kPlanChangesHeader)
      throw UserError(place + ": expected " + kPlanChangesHeader);
  }
  return table;
}

/// A new file of the owner's, never an existing one.
void write_new(const std::filesystem::path& file, const std::string& text) {
  const auto refuse = [&] { throw UserError(file.string() + ": " + std::strerror(errno)); };
  const int to = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (to < 0) refuse();
  const bool is_whole = ::write(to, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = errno;
  if (::close(to) == 0 && is_whole) return;
  errno = is_whole ? errno : error;
  refuse();
}

}  // namespace

const char* to_string(PlanChangeKind kind) {
  return kind == PlanChangeKind::kOptimised ? "optimised" : "edited";
}

std::vector<PlanChange> load_plan_changes(const std::filesystem::path& folder) {
  return load_table(folder).changes;
}

PlanChangeLog::PlanChangeLog(std::filesystem::path folder) : folder_(std::move(folder)) {
  ChangeTable table = load_table(folder_);
  changes_ = std::move(table.changes);
  has_kinds_ = table.has_kinds;
}

void PlanChangeLog::add(double t_s, const Plan& whole, PlanChangeKind kind, const std::string& what) {
  PlanChange change{t_s, {}, kind, one_line(what)};
  std::error_code none;
  for (std::size_t n = changes_.size() + 1;; ++n) {  // one that no row names stays
    change.file = "plan_change_" + std::to_string(n) + ".toml";
    if (!std::filesystem::exists(folder_ / change.file, none)) break;
  }
  std::ostringstream time;
  time.setf(std::ios::fixed);
  time.precision(1);
  time << t_s;
  write_new(folder_ / change.file,
            to_toml(whole, {change.what + ", at " + time.str() + " s of the session"}));
  if (std::filesystem::exists(folder_ / kPlanChangesFile, none))
    truncate_partial_line(folder_ / kPlanChangesFile);
  RowFile rows(folder_ / kPlanChangesFile, RowFile::Start::kSession,
               has_kinds_ ? kPlanChangesHeader : kPlanChangesWithoutKindHeader);
  rows.add(time.str() + "," + change.file + "," + (has_kinds_ ? to_string(kind) + std::string(",") : "") +
           change.what);
  rows.flush();
  if (rows.has_failed()) throw UserError(rows.failure());
  changes_.push_back(std::move(change));
}

}  // namespace brachy
