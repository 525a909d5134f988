#include "apps/session/plan_change_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include "apps/forces/row_file.h"
#include "apps/session/whole_lines.h"
#include "core/base/error.h"
#include "core/base/one_line.h"
#include "core/brachytherapy/plan/plan_file.h"

namespace brachy {
namespace {

PlanChange parse_plan_change(const std::string& line, const std::string& place) {
  const std::size_t first = line.find(','),
                    second = first == std::string::npos ? first : line.find(',', first + 1);
  PlanChange change;
  if (second != std::string::npos) {
    const auto [end, error] = std::from_chars(line.data(), line.data() + first, change.t_s);
    change.file = line.substr(first + 1, second - first - 1);
    change.what = line.substr(second + 1);
    const bool is_own = !change.file.empty() && change.file.find('/') == std::string::npos;
    if (error == std::errc() && end == line.data() + first && is_own) return change;
  }
  throw UserError(place + ": is no change of a plan; expected " + kPlanChangesHeader);
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

std::vector<PlanChange> load_plan_changes(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / kPlanChangesFile;
  std::vector<PlanChange> changes;
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return changes;
  std::ifstream in(file, std::ios::binary);
  std::ostringstream content;
  if (!(content << in.rdbuf())) throw UserError(file.string() + ": cannot be read");
  std::istringstream lines(content.str().substr(0, content.str().rfind('\n') + 1));
  std::string line;
  for (std::size_t n = 1; std::getline(lines, line); ++n) {
    const std::string place = file.string() + ":" + std::to_string(n);
    if (n > 1)
      changes.push_back(parse_plan_change(line, place));
    else if (line != kPlanChangesHeader)
      throw UserError(place + ": expected " + kPlanChangesHeader);
  }
  return changes;
}

PlanChangeLog::PlanChangeLog(std::filesystem::path folder)
    : folder_(std::move(folder)), changes_(load_plan_changes(folder_)) {}

void PlanChangeLog::add(double t_s, const Plan& whole, const std::string& what) {
  PlanChange change{t_s, {}, one_line(what)};
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
  RowFile rows(folder_ / kPlanChangesFile, RowFile::Start::kSession, kPlanChangesHeader);
  rows.add(time.str() + "," + change.file + "," + change.what);
  rows.flush();
  if (rows.has_failed()) throw UserError(rows.failure());
  changes_.push_back(std::move(change));
}

}  // namespace brachy
