#include <algorithm>
#include <charconv>
#include <optional>
#include <vector>

#include "core/base/number_csv.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/plan/hole_names.h"
#include "core/brachytherapy/plan/plan_check.h"
#include "core/brachytherapy/plan/plan_file.h"

namespace brachy {
namespace {

constexpr std::size_t kColumns = 8;  // of kPlanCsvHeader
constexpr std::string_view kHoleColumns =
    ",letters_from,half_steps";  // where holes are not named as on the wire

struct Line {
  const std::string& file;
  std::size_t number;
  [[noreturn]] void refuse(const std::string& what) const { refuse_line(file, number, what); }
  RefuseKey refuse_key() const {
    return [this](const char* key, const std::string& what) { refuse("'" + std::string(key) + "' " + what); };
  }
};

std::string_view cut_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// The cells of one line as in RFC 4180: "…" may contain commas, and "" in it is one ".
std::vector<std::string> split(std::string_view text, const Line& line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '"' && text.substr(i + 1).starts_with('"')) {
      cells.back() += text[++i];
    } else if (c == '"' && (quoted || cells.back().empty())) {
      quoted = !quoted;
      if (!quoted && i + 1 < text.size() && text[i + 1] != ',')
        line.refuse("text follows a closing \"; write a \" within a cell twice");
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else {
      cells.back() += c;
    }
  }
  if (quoted) line.refuse("a \" is not closed; close it on the same line");
  return cells;
}

double number(const std::string& cell, const char* key, double least, double most, const Line& line) {
  double value = 0;
  const char* end = cell.data() + cell.size();
  const auto read = std::from_chars(cell.data(), end, value);
  if (read.ec != std::errc() || read.ptr != end) line.refuse_key()(key, "needs a number, such as 12.5");
  if (!(value >= least && value <= most))
    line.refuse_key()(
        key, "is " + text_of(value) + "; it must be between " + text_of(least) + " and " + text_of(most));
  return value;
}

SourceModel source(const std::string& cell, const Line& line) {
  const auto model = find_seed_source(cell);
  if (!model)
    line.refuse_key()("source", "is \"" + one_short_line(cell) + "\"; it must be one of: " + source_names());
  return *model;
}

/// The columns of a row that describe the whole plan.
Plan plan_of(const std::vector<std::string>& cells, const Line& line) {
  using L = PlanLimits;
  Plan plan;
  plan.base_plane_mm = number(cells[3], "base_plane_mm", L::kLeastBasePlaneMm, L::kMostBasePlaneMm, line);
  plan.source = source(cells[4], line);
  plan.air_kerma_strength_u =
      number(cells[5], "air_kerma_strength_u", L::kLeastStrengthU, L::kMostStrengthU, line);
  plan.prescription_gy =
      number(cells[6], "prescription_gy", L::kLeastPrescriptionGy, L::kMostPrescriptionGy, line);
  plan.name = cells[7];
  check_name(plan.name, line.refuse_key());
  return plan;
}

/// The grid by the names that a row states.
TemplateGrid names_in(const std::vector<std::string>& cells, const TemplateGrid& grid, const Line& line) {
  const auto is_one_of = [](const std::string& cell, const char* a, const char* b) {
    return cell == a || cell == b;
  };
  if (!is_one_of(cells[kColumns], "left", "right"))
    line.refuse_key()("letters_from",
                      "is \"" + one_short_line(cells[kColumns]) + "\"; it must be left or right");
  if (!is_one_of(cells[kColumns + 1], "true", "false"))
    line.refuse_key()("half_steps",
                      "is \"" + one_short_line(cells[kColumns + 1]) + "\"; it must be true or false");
  return grid.named(cells[kColumns], cells[kColumns + 1] == "true");
}

void read_row(const std::vector<std::string>& cells, Plan& plan, const PlanLimits& limits, const Line& line) {
  Plan said = plan_of(cells, line);
  said.needles = plan.needles;
  if (plan.needles.empty()) plan = said;
  if (said != plan)
    line.refuse(
        "differs from the first row in the columns after train, which are the plan's; make all rows the "
        "same");
  plan.needles.push_back(
      {cells[0], number(cells[1], "retraction_mm", 0, PlanLimits::kMostRetractionMm, line), cells[2]});
  check_needle(plan, plan.needles.size() - 1, limits, line.refuse_key());
}

/// The text between the quotes.
std::string csv_escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out;
}

}  // namespace

Plan parse_plan_csv(std::string_view text, const std::string& name, const TemplateGrid& grid,
                    double needle_length_mm) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // the byte order mark that spreadsheets write
  Plan plan;
  bool header_seen = false, names_holes = false;
  std::optional<TemplateGrid> named;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::string_view content = cut_line(text);
    const Line line{name, ++number};
    if (content.find_first_not_of(" \t") == content.npos || content.front() == '#') continue;
    if (!header_seen) {
      names_holes = content == std::string(kPlanCsvHeader).append(kHoleColumns);
      if (!names_holes && content != kPlanCsvHeader)
        line.refuse(
            std::string("expected the header ").append(kPlanCsvHeader).append("; add it as the first line"));
      header_seen = true;
      continue;
    }
    const std::vector<std::string> cells = split(content, line);
    const std::size_t columns = kColumns + (names_holes ? 2 : 0);
    if (cells.size() != columns)
      line.refuse("found " + std::to_string(cells.size()) + " columns, expected " + std::to_string(columns) +
                  " (" + kPlanCsvHeader + std::string(names_holes ? kHoleColumns : "") + ")");
    const TemplateGrid names = names_holes ? names_in(cells, grid, line) : grid.named_as_on_wire();
    if (!named) named = names;
    if (*named != names)
      line.refuse("names its hole in another way than the first row; make all rows the same");
    read_row(cells, plan, {*named, needle_length_mm}, line);
  }
  if (plan.needles.empty())
    refuse_line(name, std::max<std::size_t>(number, 1),
                "no needle; give the header " + std::string(kPlanCsvHeader) + " and a row for each needle");
  rename_holes(plan.needles, *named, grid);
  return plan;
}

std::string to_csv(const Plan& plan, const TemplateGrid& grid, const std::vector<std::string>& notes) {
  const bool names_holes = !grid.is_named_as(grid.named_as_on_wire());
  const std::string of_plan =
      exact_text(plan.base_plane_mm) + "," + std::string(to_string(plan.source)) + "," +
      exact_text(plan.air_kerma_strength_u) + "," + exact_text(plan.prescription_gy) + ",\"" +
      csv_escaped(plan.name) + "\"" +
      (names_holes ? "," + grid.letters_from + (grid.half_steps ? ",true" : ",false") : "") + "\n";
  std::string out;
  for (const std::string& note : notes) out += "# Note: " + note + "\n";
  out += kPlanCsvHeader;
  if (names_holes) out += kHoleColumns;
  out += '\n';
  for (const PlanNeedle& needle : plan.needles)
    out += needle.hole + "," + exact_text(needle.retraction_mm) + "," + needle.train + "," + of_plan;
  return out;
}

}  // namespace brachy
