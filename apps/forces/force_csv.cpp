// Writing and parsing the rows of a force log.
#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <optional>
#include <sstream>

#include "apps/forces/force_log.h"
#include "core/base/error.h"
#include "core/base/number_csv.h"

namespace brachy {
namespace {

constexpr std::array kStates = {ContactState::kFree, ContactState::kTouching, ContactState::kInserted,
                                ContactState::kThrough, ContactState::kWithdrawn};

constexpr std::size_t kShortestRow = 26;  // bytes: 13 cells and what separates them

template <class T>
void append(std::string& row, T value) {
  std::array<char, 32> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  row.append(buffer.data(), end.ptr);
}

std::string_view cut(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view head = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return head;
}

/// One row's cells, in order; each column's name comes from the header.
class Cells {
 public:
  Cells(std::string_view header, std::string_view row, const std::string& name, std::size_t line)
      : header_(header), row_(row), rest_(row), name_(name), line_(line) {}

  template <class T>
  T number() {
    T value{};
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    const auto size = static_cast<std::size_t>(end - rest_.data());
    if (error != std::errc() || (size < rest_.size() && rest_[size] != ','))
      refuse(std::string(column()) + " is not a valid number; was the log edited?");
    go_behind(size);
    return value;
  }

  ContactState state() {
    const std::string_view cell = rest_.substr(0, rest_.find(','));
    for (ContactState state : kStates)
      if (to_string(state) == cell) {
        go_behind(cell.size());
        return state;
      }
    refuse("state must be free, touching, inserted, through or withdrawn");
  }

  /// After the last cell: refuses a row with more.
  void end() {
    if (seen_ != 1 + commas(row_)) refuse({});
  }

 private:
  static std::ptrdiff_t commas(std::string_view text) { return std::count(text.begin(), text.end(), ','); }

  void go_behind(std::size_t cell) {
    rest_.remove_prefix(std::min(cell + 1, rest_.size()));
    ++seen_;
  }

  std::string_view column() const {
    std::string_view left = header_;
    for (std::ptrdiff_t i = 0; i < seen_; ++i) cut(left, ',');
    return cut(left, ',');
  }

  /// A wrong number of columns explains whatever else is wrong.
  [[noreturn]] void refuse(const std::string& what) const {
    const std::ptrdiff_t found = commas(row_), expected = commas(header_);
    if (found == expected) refuse_line(name_, line_, what);
    refuse_line(name_, line_,
                "found " + std::to_string(1 + found) + " columns, expected " + std::to_string(1 + expected) +
                    "; is the file truncated?");
  }

  std::string_view header_, row_, rest_;
  const std::string& name_;
  std::size_t line_;
  std::ptrdiff_t seen_ = 0;
};

ForceSample parse_row(ForceColumns columns, std::string_view row, const std::string& name, std::size_t line) {
  Cells cells(force_log_header(columns), row, name, line);
  ForceSample sample;
  sample.t_s = cells.number<double>();
  sample.needle = cells.number<std::uint32_t>();
  sample.state = cells.state();
  sample.depth_mm = cells.number<double>();
  for (int i = 0; i < 3; ++i) sample.forces.force_n[i] = cells.number<double>();
  sample.forces.axial_n = cells.number<double>();
  sample.forces.lateral_n = cells.number<double>();
  sample.forces.cutting_n = cells.number<double>();
  sample.forces.friction_n = cells.number<double>();
  sample.landmarks = cells.number<std::uint32_t>();
  sample.min_det = cells.number<double>();
  if (columns != ForceColumns::kRigid) sample.tip_deflection_mm = cells.number<double>();
  if (columns == ForceColumns::kAll)
    for (int i = 0; i < 3; ++i) sample.forces.guide_n[i] = cells.number<double>();
  sample.forces.force_n += sample.forces.guide_n;
  cells.end();
  return sample;
}

}  // namespace

std::optional<ForceColumns> force_columns(std::string_view header) {
  for (const ForceColumns columns : {ForceColumns::kAll, ForceColumns::kUnguided, ForceColumns::kRigid})
    if (header == force_log_header(columns)) return columns;
  return {};
}

std::string force_row(const ForceSample& sample, ForceColumns columns) {
  const NeedleForces& f = sample.forces;
  const Vec3 force = columns == ForceColumns::kAll ? Vec3(f.force_n - f.guide_n) : f.force_n;
  std::string row;
  append(row, sample.t_s);
  row += ',';
  append(row, sample.needle);
  row += ',';
  row += to_string(sample.state);
  for (double value : {sample.depth_mm, force.x(), force.y(), force.z(), f.axial_n, f.lateral_n, f.cutting_n,
                       f.friction_n}) {
    row += ',';
    append(row, value);
  }
  row += ',';
  append(row, sample.landmarks);
  row += ',';
  append(row, sample.min_det);
  if (columns == ForceColumns::kRigid) return row;
  row += ',';
  append(row, sample.tip_deflection_mm);
  if (columns == ForceColumns::kUnguided) return row;
  for (int i = 0; i < 3; ++i) {
    row += ',';
    append(row, f.guide_n[i]);
  }
  return row;
}

void ForceLogReader::read(std::string_view lines, const std::function<void(const ForceSample&)>& visit) {
  while (!lines.empty()) {
    std::string_view line = cut(lines, '\n');
    ++lines_;
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line.empty() || line.front() == '#') continue;
    if (!columns_) {
      columns_ = force_columns(line);
      if (!columns_)
        refuse_line(name_, lines_,
                    "is not a force log: expected the header " + std::string(kForceLogHeader) +
                        "; `brachy replay --offline --log` and `brachy record` write them");
      continue;
    }
    const ForceSample sample = parse_row(*columns_, line, name_, lines_);
    const auto [last, first] = last_s_.try_emplace(sample.needle, sample.t_s);
    if (!first && !(sample.t_s > last->second))
      refuse_line(
          name_, lines_,
          "t_s does not increase for needle " + std::to_string(sample.needle) + "; was the log sorted?");
    last->second = sample.t_s;
    ++rows_;
    visit(sample);
  }
}

void ForceLogReader::end() const {
  if (rows_ == 0)
    throw UserError(name_ + ":" + std::to_string(std::max<std::size_t>(lines_, 1)) +
                    ": has no rows; was there a needle?");
}

std::vector<ForceSample> parse_force_log(std::string_view text, const std::string& name) {
  std::vector<ForceSample> samples;
  const auto lines = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  samples.reserve(std::min(lines, 1 + text.size() / kShortestRow));
  ForceLogReader reader(name);
  reader.read(text, [&](const ForceSample& sample) { samples.push_back(sample); });
  reader.end();
  return samples;
}

std::vector<ForceSample> load_force_log(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    throw UserError(file.string() +
                    ": no such file; give a log of `brachy replay --offline --log` or `brachy record`");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(file.string() + ": cannot be read; check its permissions");
  return parse_force_log(text.view(), file.string());
}

}  // namespace brachy
