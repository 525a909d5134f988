#include "apps/session/earlier_session.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <system_error>

#include "apps/session/whole_lines.h"
#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "haptics/trajectory/needle_trajectories.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestS = 1e9;
constexpr std::uintmax_t kLargestBlank = 65536;
constexpr const char* kFix = "; repair it from a copy, or give another directory";

void make(const fs::path& folder) {
  refuse_denied_folder(folder);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw UserError(folder.string() + ": cannot be created: " + error.message());
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    throw UserError(folder.string() + ": no permission to write into this folder (" + std::strerror(errno) +
                    "); give another directory");
}

bool is_blank(const fs::path& file) {
  if (fs::file_size(file) > kLargestBlank) return false;
  std::ifstream in(file, std::ios::binary);
  return std::all_of(std::istreambuf_iterator<char>(in), {},
                     [](unsigned char c) { return std::isspace(c) != 0; });
}

std::string first_line(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  std::getline(in, line);
  return line;
}

double checked_time(double t_s, const fs::path& file) {
  if (std::isfinite(t_s) && t_s >= 0 && t_s <= kLongestS) return t_s;
  throw UserError(file.string() + ": its last row's time is " + std::to_string(t_s) + kFix);
}

/// The time of the last row, 0 without; `read` parses a file of header and one row.
double end_of(const fs::path& file, const std::string& header, const char* other_header,
              const std::function<double(const std::string& text)>& read) {
  truncate_partial_line(file);
  if (fs::file_size(file) == 0) return 0;
  if (first_line(file) != header) throw UserError(file.string() + ":1: " + other_header);
  const std::string row = last_line(file);
  if (row == header) return 0;
  try {
    return checked_time(read(header + "\n" + row + "\n"), file);
  } catch (const UserError& error) {
    throw UserError(file.string() + ": its last row is none that brachyd wrote (" + error.what() + ")" +
                    kFix);
  }
}

}  // namespace

EarlierSession examine_earlier_session(const fs::path& folder, const std::string& poses_header,
                                       std::size_t needle_count) {
  make(folder);
  EarlierSession earlier;
  bool is_there = false;
  std::string gaps;
  for (const char* name : {kPosesFile, kForcesFile, kSeedsFile}) {
    const fs::path file = folder / name;
    std::error_code error;
    const fs::file_status status = fs::status(file, error);
    const bool exists = fs::exists(status);
    if (exists && !fs::is_regular_file(status))
      throw UserError(file.string() + ": is not a regular file; remove it, or give another directory");
    const bool blank = exists && is_blank(file);
    if (blank) fs::resize_file(file, 0);
    is_there |= exists && !blank;
    if (!exists || blank)
      gaps += (gaps.empty() ? "" : ", ") + std::string(name) + (blank ? " is blank" : " is missing");
  }
  if (!is_there) return earlier;
  earlier.missing_text = gaps;
  const auto exists = [&](const char* name) { return fs::exists(folder / name); };
  if (exists(kPosesFile))
    earlier.end_s = end_of(folder / kPosesFile, poses_header,
                           "a recording with another number of needles; give another directory",
                           [&](const std::string& text) {
                             const NeedleTrajectories poses =
                                 parse_trajectories(text, "row", static_cast<std::uint32_t>(needle_count));
                             return poses.needles().at(0).motion.samples().at(0).t_s;
                           });
  if (exists(kForcesFile)) {
    earlier.force_columns = force_columns(first_line(folder / kForcesFile)).value_or(ForceColumns::kAll);
    earlier.end_s =
        std::max(earlier.end_s,
                 end_of(folder / kForcesFile, std::string(force_log_header(earlier.force_columns)),
                        "not a force log of this version; give another directory",
                        [](const std::string& text) { return parse_force_log(text, "row").at(0).t_s; }));
  }
  return earlier;
}

double latest_seed_s(const std::vector<Seed>& seeds, const fs::path& file) {
  double latest_s = 0;
  for (const Seed& seed : seeds) latest_s = std::max(latest_s, checked_time(seed.t_s, file));
  return latest_s;
}

}  // namespace brachy
