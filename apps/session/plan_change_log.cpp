#include "apps/session/plan_change_log.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include "apps/forces/row_file.h"
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

ChangeTable load_table(const SessionFolder& folder) {
  const std::string file = folder.path_of(kPlanChangesFile).string();
  ChangeTable table;
  const std::optional<std::string> text = folder.read(kPlanChangesFile);
  if (!text) return table;
  if (whole_lines(*text).empty() && !std::string_view(kPlanChangesHeader).starts_with(*text))
    throw UserError(file + ":1: expected " + kPlanChangesHeader);
  std::istringstream lines{std::string(whole_lines(*text))};
  std::string line;
  for (std::size_t n = 1; std::getline(lines, line); ++n) {
    const std::string place = file + ":" + std::to_string(n);
    if (n > 1)
      table.changes.push_back(parse_plan_change(line, table.has_kinds, place));
    else if (line == kPlanChangesWithoutKindHeader)
      table.has_kinds = false;
    else if (line != kPlanChangesHeader)
      throw UserError(place + ": expected " + kPlanChangesHeader);
  }
  return table;
}

}  // namespace

const char* to_string(PlanChangeKind kind) {
  return kind == PlanChangeKind::kOptimised ? "optimised" : "edited";
}

std::vector<PlanChange> load_plan_changes(const SessionFolder& folder) {
  return load_table(folder).changes;
}

PlanChangeLog::PlanChangeLog(SessionFolder folder) : folder_(std::move(folder)) {
  ChangeTable table = load_table(folder_);
  changes_ = std::move(table.changes);
  has_kinds_ = table.has_kinds;
}

void PlanChangeLog::add(double t_s, const Plan& whole, const TemplateGrid& grid, PlanChangeKind kind,
                        const std::string& what) {
  PlanChange change{t_s, {}, kind, one_line(what)};
  for (std::size_t n = changes_.size() + 1;; ++n) {  // one that no row names stays
    change.file = kPlanChange.name + std::to_string(n) + ".toml";
    if (!folder_.has(change.file)) break;
  }
  std::ostringstream time;
  time.setf(std::ios::fixed);
  time.precision(1);
  time << t_s;
  folder_.write_new(change.file,
                    to_toml(whole, grid, {change.what + ", at " + time.str() + " s of the session"}));
  RowFile rows(folder_.append_to(kPlanChangesFile), folder_.path_of(kPlanChangesFile).string(),
               has_kinds_ ? kPlanChangesHeader : kPlanChangesWithoutKindHeader);
  rows.add(time.str() + "," + change.file + "," + (has_kinds_ ? to_string(kind) + std::string(",") : "") +
           change.what);
  rows.flush();
  if (rows.has_failed()) throw UserError(rows.failure());
  changes_.push_back(std::move(change));
}

}  // namespace brachy
