#include "core/brachytherapy/structures/organ_pass_file.h"

#include <algorithm>
#include <array>

#include "core/base/number_csv.h"

namespace brachy {

std::string organ_pass_row(const OrganPass& pass) {
  const std::array<double, 13> row = {static_cast<double>(pass.tick),
                                      pass.t_s,
                                      static_cast<double>(pass.needle),
                                      static_cast<double>(pass.pass),
                                      pass.is_ended ? 1.0 : 0.0,
                                      pass.depth_mm,
                                      pass.time_s,
                                      pass.entered_at.x(),
                                      pass.entered_at.y(),
                                      pass.entered_at.z(),
                                      pass.axis.x(),
                                      pass.axis.y(),
                                      pass.axis.z()};
  std::string text = pass.organ + ",";
  append_csv_row(text, row);
  return text;
}

std::vector<OrganPass> parse_organ_passes(std::string_view text, const std::string& name) {
  // The names apart: the rest are numbers, in lines of the same number.
  std::vector<std::string> organs;
  std::string numbers;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    const std::size_t comma = line.find(',');
    if (begin > 0 && comma != std::string_view::npos) organs.emplace_back(line.substr(0, comma));
    numbers += comma == std::string_view::npos ? line : line.substr(comma + 1);
    numbers += '\n';
    begin = end + 1;
  }
  NumberCsvLimits limits;
  limits.may_be_empty = true;
  const std::string_view header = kOrganPassHeader.substr(kOrganPassHeader.find(',') + 1);
  const NumberTable table = parse_number_csv(numbers, name, header, limits);
  if (table.rows() != organs.size()) refuse_line(name, 1, "a row has no organ; was the file edited?");
  std::vector<OrganPass> passes;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const std::span<const double> row = table.row(i);
    for (const std::size_t k : {0, 2, 3})
      if (row[k] < 0 || row[k] > 9e15)
        refuse_line(name, table.lines[i], "a count is not valid; was the file edited?");
    const OrganPass pass{organs[i],
                         static_cast<std::uint64_t>(row[0]),
                         row[1],
                         static_cast<std::uint32_t>(row[2]),
                         static_cast<std::uint32_t>(row[3]),
                         row[4] != 0,
                         row[5],
                         row[6],
                         {row[7], row[8], row[9]},
                         {row[10], row[11], row[12]}};
    // The beginning of this one, of the same run: the last that is not ended.
    const auto begun = std::find_if(passes.rbegin(), passes.rend(), [&](const OrganPass& other) {
      return pass.is_ended && !other.is_ended && other.organ == pass.organ && other.needle == pass.needle &&
             other.pass == pass.pass;
    });
    if (begun != passes.rend())
      *begun = pass;
    else
      passes.push_back(pass);
  }
  return passes;
}

OrganPass pass_of(const OrganContact& contact, const std::string& organ, std::uint32_t needle, double t_s,
                  bool is_ended) {
  return {organ,
          is_ended ? contact.left_tick : contact.entered_tick,
          t_s,
          needle,
          contact.passes,
          is_ended,
          contact.depth_mm,
          contact.time_s,
          contact.entered_at,
          contact.axis};
}

}  // namespace brachy
