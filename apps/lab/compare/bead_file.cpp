#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>

#include "apps/lab/compare/compare_beads.h"
#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

constexpr const char* kExpected = "i,j,k,x0,y0,z0,x1,y1,z1";
constexpr std::size_t kMostBeads = 1500;  // the models decompose dense matrices

std::map<std::string, std::size_t> columns_of(const std::string& header, const std::string& name) {
  std::map<std::string, std::size_t> columns;
  for (std::size_t from = 0, index = 0; from <= header.size(); ++index) {
    const std::size_t end = std::min(header.find(',', from), header.size());
    const std::string column = header.substr(from, end - from);
    if (!std::ranges::all_of(column, [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; }))
      throw UserError(name + ":1: column '" + one_short_line(column) +
                      "' has other characters than letters, digits and _; give a header like " + kExpected);
    if (!columns.emplace(column, index).second)
      throw UserError(name + ":1: column '" + one_short_line(column) + "' appears twice; remove one");
    from = end + 1;
  }
  return columns;
}

std::array<std::size_t, 3> triple(const std::map<std::string, std::size_t>& columns,
                                  const std::array<std::string, 3>& names, const std::string& name) {
  std::array<std::size_t, 3> at;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto found = columns.find(names[k]);
    if (found == columns.end())
      throw UserError(name + ":1: no column '" + names[k] + "'; give a header like " + kExpected +
                      " (xN,yN,zN for load N)");
    at[k] = found->second;
  }
  return at;
}

// N of every load with a column xN, yN or zN, except 0.
std::vector<int> loads_of(const std::map<std::string, std::size_t>& columns) {
  std::vector<int> numbers;
  for (const auto& [column, index] : columns) {
    int number = 0;
    const char* end = column.data() + column.size();
    if (column.size() < 2 || (column[0] != 'x' && column[0] != 'y' && column[0] != 'z')) continue;
    if (const auto read = std::from_chars(column.data() + 1, end, number);
        read.ec == std::errc() && read.ptr == end && number > 0)
      numbers.push_back(number);
  }
  std::ranges::sort(numbers);
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

Vec3 vec3(std::span<const double> row, const std::array<std::size_t, 3>& at) {
  return {row[at[0]], row[at[1]], row[at[2]]};
}

void check_rest(const Beads& beads, const NumberTable& table, const std::string& name) {
  for (std::size_t i = 0; i < beads.rest.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if ((beads.rest[i] - beads.rest[j]).norm() < 1e-6)
        refuse_line(
            name, table.lines[i],
            "a bead with the indices of that in line " + std::to_string(table.lines[j]) + "; remove one");
  Vec3 centre = Vec3::Zero();
  for (const std::size_t i : beads.boundary)
    centre += beads.rest[i] / static_cast<double>(beads.boundary.size());
  Mat3 spread = Mat3::Zero();
  for (const std::size_t i : beads.boundary)
    spread += (beads.rest[i] - centre) * (beads.rest[i] - centre).transpose();
  const bool is_solid =
      beads.boundary.size() >= 5 && spread.determinant() > 1e-9 * std::pow(spread.trace() / 3, 3);
  if (!is_solid || beads.interior.empty())
    throw UserError(name + ": " + std::to_string(beads.boundary.size()) + " boundary and " +
                    std::to_string(beads.interior.size()) +
                    " interior beads; needs five on the boundary that are not coplanar, and one within");
}

}  // namespace

Beads load_beads(const std::filesystem::path& file) {
  const NumberCsvLimits limits{.max_rows = kMostBeads};
  const std::string name = file.string(), text = load_csv_text(file, kExpected, limits.max_bytes);
  std::string header = csv_header(text);
  if (header.empty()) header = kExpected;
  const auto columns = columns_of(header, name);
  const NumberTable table = parse_number_csv(text, name, header, limits);
  const auto index = triple(columns, {"i", "j", "k"}, name), rest = triple(columns, {"x0", "y0", "z0"}, name);
  const std::vector<int> numbers = loads_of(columns);
  if (numbers.empty())
    throw UserError(name + ":1: no columns of a load; give a header like " + kExpected +
                    " (xN,yN,zN for load N)");

  Beads beads;
  std::vector<Vec3> lattice;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    lattice.push_back(vec3(table.row(i), index));
    if (lattice[i] != Vec3(lattice[i].array().round()))
      refuse_line(name, table.lines[i], "i, j and k are whole numbers: the bead's position in its lattice");
    beads.rest.push_back(vec3(table.row(i), rest));
  }
  for (const int number : numbers) {
    const std::string n = std::to_string(number);
    const auto at = triple(columns, {"x" + n, "y" + n, "z" + n}, name);
    Beads::Load load{number, {}};
    for (std::size_t i = 0; i < table.rows(); ++i)
      load.displacements.push_back(vec3(table.row(i), at) - beads.rest[i]);
    beads.loads.push_back(std::move(load));
  }
  Vec3 least = lattice[0], most = lattice[0];
  for (const Vec3& l : lattice) {
    least = least.cwiseMin(l);
    most = most.cwiseMax(l);
  }
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const bool is_boundary =
        (lattice[i].array() == least.array() || lattice[i].array() == most.array()).any();
    (is_boundary ? beads.boundary : beads.interior).push_back(i);
  }
  check_rest(beads, table, name);
  return beads;
}

}  // namespace brachy
