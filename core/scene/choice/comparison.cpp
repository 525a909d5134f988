#include "core/scene/choice/comparison.h"

#include <charconv>

#include "core/base/number_csv.h"

namespace brachy {

extern const std::string_view kStoredComparison;  // of the build: core/scene/choice/comparison.csv

namespace {

constexpr std::string_view kHeader =
    "model,kernel,support_mm,anchors,landmark_spacing_mm,surface,scene,contrast,poisson,free_faces,error_mm,"
    "tick_ms,min_det";
constexpr std::size_t kColumns = 13;

std::string_view cut(std::string_view& text, char at) {
  const std::size_t end = text.find(at);
  const std::string_view head = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return head;
}

}  // namespace

std::vector<ChartedRow> parse_comparison(std::string_view text, const std::string& name) {
  std::vector<ChartedRow> rows;
  for (std::size_t line = 1; !text.empty(); ++line) {
    std::string_view rest = cut(text, '\n');
    if (line == 1 && rest != kHeader) refuse_line(name, line, "expected the header " + std::string(kHeader));
    if (line == 1 || rest.empty()) continue;
    std::array<std::string_view, kColumns> cells;
    for (auto& cell : cells) cell = cut(rest, ',');
    const auto number = [&](std::size_t column) {
      double value = 0;
      const std::string_view cell = cells[column];
      const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
      if (error != std::errc() || end != cell.data() + cell.size())
        refuse_line(
            name, line,
            "'" + std::string(cell) + "' is not a number; write it with scripts/charts/ticks.sh --store");
      return value;
    };
    ChartedRow& row = rows.emplace_back();
    row.model = cells[0];
    row.kernel = cells[1];
    row.support_mm = number(2);
    row.has_anchors = number(3) != 0;
    row.landmark_spacing_mm = number(4);
    row.is_surface = number(5) != 0;
    row.scene = cells[6];
    row.contrast = number(7);
    row.poisson = number(8);
    row.free_faces = static_cast<int>(number(9));
    row.error_mm = number(10);
    row.tick_ms = number(11);
    row.min_det = number(12);
  }
  return rows;
}

const std::vector<ChartedRow>& stored_comparison() {
  static const std::vector<ChartedRow> rows =
      parse_comparison(kStoredComparison, "core/scene/choice/comparison.csv");
  return rows;
}

}  // namespace brachy
