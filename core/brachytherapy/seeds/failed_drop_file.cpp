#include "core/brachytherapy/seeds/failed_drop_file.h"

#include <array>
#include <cmath>

#include "core/base/number_csv.h"

namespace brachy {

std::string failed_drop_row(const FailedDrop& drop) {
  const std::array<double, 8> row = {static_cast<double>(drop.tick),
                                     drop.t_s,
                                     static_cast<double>(drop.needle),
                                     static_cast<double>(drop.planned),
                                     static_cast<double>(drop.why),
                                     drop.at.x(),
                                     drop.at.y(),
                                     drop.at.z()};
  std::string text;
  append_csv_row(text, row);
  return text;
}

std::vector<FailedDrop> parse_failed_drops(std::string_view text, const std::string& name) {
  NumberCsvLimits limits;
  limits.may_be_empty = true;
  const NumberTable table = parse_number_csv(text, name, kFailedDropHeader, limits);
  std::vector<FailedDrop> drops;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const std::span<const double> row = table.row(i);
    const bool is_valid = row[0] >= 0 && row[0] < 9e15 && row[2] >= 0 && row[2] <= 65535 && row[3] >= -1 &&
                          row[3] < 1e6 && row[4] >= 1 && row[4] <= 7;
    if (!is_valid) refuse_line(name, table.lines[i], "a number is not valid; was the file edited?");
    drops.push_back({static_cast<std::uint64_t>(row[0]),
                     row[1],
                     static_cast<std::uint16_t>(row[2]),
                     static_cast<std::int32_t>(row[3]),
                     static_cast<DropRefusal>(std::lround(row[4])),
                     {row[5], row[6], row[7]}});
  }
  return drops;
}

}  // namespace brachy
