#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/forces/row_file.h"
#include "core/simulation/mesh_state.h"

namespace brachy {

/// A row of a force log: one needle in one tick.
struct ForceSample {
  double t_s = 0;
  std::uint32_t needle = 0;
  ContactState state = ContactState::kFree;
  double depth_mm = 0;  ///< NeedleState::tip_depth_mm
  NeedleForces forces;  ///< without the torques
  std::uint32_t landmarks = 0;
  double min_det = 1;  ///< the least det(I + ∇u) at the tissue's vertices in this tick, all needles' field
  double tip_deflection_mm = 0;  ///< NeedleShape::tip_deflection_mm()

  bool operator==(const ForceSample&) const = default;
};

ForceSample force_sample(double t_s, std::uint32_t needle, const NeedleState& state, double min_det);

/// The first line of a force log.
inline constexpr std::string_view kForceLogHeader =
    "t_s,needle,state,depth_mm,fx_n,fy_n,fz_n,axial_n,lateral_n,cutting_n,friction_n,landmarks,min_det,"
    "tip_deflection_mm,guide_x_n,guide_y_n,guide_z_n";
/// Of logs from before the template's force was told apart.
inline constexpr std::string_view kUnguidedForceLogHeader =
    kForceLogHeader.substr(0, kForceLogHeader.find(",guide_x_n"));
/// Of logs from before needles could bend: all but the last column of these.
inline constexpr std::string_view kRigidForceLogHeader =
    kUnguidedForceLogHeader.substr(0, kUnguidedForceLogHeader.rfind(','));

/// Which columns a log has.
enum class ForceColumns { kAll, kUnguided, kRigid };
constexpr std::string_view force_log_header(ForceColumns columns) {
  switch (columns) {
    case ForceColumns::kRigid:
      return kRigidForceLogHeader;
    case ForceColumns::kUnguided:
      return kUnguidedForceLogHeader;
    case ForceColumns::kAll:
      break;
  }
  return kForceLogHeader;
}
/// The columns that a log with this header has; nothing: it is none.
std::optional<ForceColumns> force_columns(std::string_view header);

/// One line without its end: the fewest digits from which the same bits are read back.
std::string force_row(const ForceSample& sample, ForceColumns columns = ForceColumns::kAll);

/// Writes a force log, buffered. A failure (disk full) stops the writing and is reported by close(): whole rows written
/// before stay, and the caller can continue.
class ForceLogWriter {
 public:
  /// `columns`: of the log that is continued. Throws UserError where the file cannot be created.
  explicit ForceLogWriter(const std::filesystem::path& file, RowFile::Start start = RowFile::Start::kAnew,
                          ForceColumns columns = ForceColumns::kAll)
      : columns_(columns), file_(file, start, force_log_header(columns)) {}
  /// Appends to an open log, whose name in errors is `name`.
  ForceLogWriter(OpenFile file, std::string name, ForceColumns columns)
      : columns_(columns), file_(std::move(file), std::move(name), force_log_header(columns)) {}

  void add(const ForceSample& sample) { file_.add(force_row(sample, columns_)); }
  void flush() { file_.flush(); }
  /// Flushes. Throws std::runtime_error, naming the file and the reason, where not every row was written.
  void close();
  bool has_failed() const { return file_.has_failed(); }
  std::string failure() const { return file_.failure(); }  ///< empty: none
  /// Rows added and, as far as known, written.
  std::uint64_t rows() const { return file_.rows(); }

 private:
  ForceColumns columns_;
  RowFile file_;
};

/// Reads a force log piece by piece, as one that is larger than the memory. Blank lines and lines that start with '#'
/// are skipped. At least one row; each needle's times increase. In a log without the last column no needle is bent.
/// Errors of all functions: UserError "name:line: what; fix". Threads: one.
class ForceLogReader {
 public:
  /// `name` stands for the file in errors.
  explicit ForceLogReader(std::string name) : name_(std::move(name)) {}
  /// Calls visit(sample) for each row of the next lines; `lines` ends with a line end, or is the last piece.
  void read(std::string_view lines, const std::function<void(const ForceSample&)>& visit);
  /// There are no more lines.
  void end() const;

 private:
  std::string name_;
  std::optional<ForceColumns> columns_;
  std::map<std::uint32_t, double> last_s_;  // by needle
  std::size_t lines_ = 0, rows_ = 0;
};

/// A force log's text, whole, as ForceLogReader.
std::vector<ForceSample> parse_force_log(std::string_view text, const std::string& name);

/// parse_force_log of a file. Throws UserError, also where it is not a readable regular file.
std::vector<ForceSample> load_force_log(const std::filesystem::path& file);

}  // namespace brachy
