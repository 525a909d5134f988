#include "core/base/number_csv.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

/// Text from the file, quoted for an error message: short and printable.
std::string quoted(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string out = "'";
  for (char c : text.substr(0, kLongest)) out += c >= ' ' && c <= '~' ? c : '?';
  return out + (text.size() > kLongest ? "…'" : "'");
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string_view cut(std::string_view& text, char separator) {
  const std::size_t end = std::min(text.find(separator), text.size());
  const std::string_view head = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return head;
}

/// Whether tabs separate the cells of a file with this header.
bool has_tabs(std::string_view header) {
  return header.find('\t') != header.npos && header.find(',') == header.npos;
}

/// A line with commas, its cells without quotes and blanks.
std::string plain_line(std::string_view line, char separator) {
  std::string plain;
  bool is_last = false;
  while (!is_last) {
    is_last = line.find(separator) == line.npos;
    std::string_view cell = trimmed(cut(line, separator));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
      cell = trimmed(cell.substr(1, cell.size() - 2));
    plain.append(cell).append(is_last ? "" : ",");
  }
  return plain;
}

std::string small_letters(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

std::size_t count_columns(std::string_view line) {
  return 1 + static_cast<std::size_t>(std::count(line.begin(), line.end(), ','));
}

/// As many as there are lines, unless they are too short for their cells.
std::size_t most_rows(std::string_view text, std::size_t columns) {
  const auto lines = 1 + static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  return std::min(lines, 1 + text.size() / (2 * columns));
}

// bytes that a message quotes; `compare --beads` has the file's own
constexpr std::size_t kLongestHeader = 240;

struct Place {
  const std::string& name;
  std::size_t line;
  [[noreturn]] void refuse(const std::string& what) const { refuse_line(name, line, what); }
};

void check_header(std::string_view line, std::string_view header, const Place& place) {
  if (line == header) return;
  if (line.find(';') != line.npos && line.find(',') == line.npos)
    place.refuse(
        "semicolons separate the columns; write commas, and points in numbers, as a spreadsheet in English "
        "does");
  const std::string expected = "expected the header " + std::string(header);
  if (line.starts_with(header) && line[header.size()] == ',')
    place.refuse("unknown columns " + quoted(line.substr(header.size() + 1)) + "; " + expected +
                 " only; remove the others");
  place.refuse(expected + ", found " + quoted(line) + "; add it as the first line");
}

/// The columns of `known` that follow `header` in `line`, each at most once.
std::vector<std::string> find_optional(std::string_view line, std::string_view header,
                                       std::span<const std::string_view> known) {
  std::vector<std::string> found;
  if (!line.starts_with(header)) return found;
  line.remove_prefix(header.size());
  while (line.starts_with(',')) {
    const std::string_view rest = line.substr(1), name = rest.substr(0, rest.find(','));
    if (std::ranges::count(known, name) == 0 || std::ranges::count(found, name) > 0) break;
    found.emplace_back(name);
    line = rest.substr(name.size());
  }
  return found;
}

double parse_number(std::string_view cell, std::size_t column, const Place& place) {
  std::string_view digits = trimmed(cell);
  if (digits.starts_with('+')) digits.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error == std::errc() && end == digits.data() + digits.size() && std::isfinite(value)) return value;
  const std::string where = "column " + std::to_string(column + 1) + " ";
  if (error == std::errc::result_out_of_range)
    place.refuse(where + quoted(cell) + " is out of range for a double; correct the value");
  if (error != std::errc() || end != digits.data() + digits.size())
    place.refuse(where + "is not a number: " + quoted(cell) + "; write it like -12.5 or 1e-3");
  place.refuse(where + "is " + quoted(cell) + "; remove the row or correct the value");
}

/// Reads a row as programs write it: finite numbers without blanks or plus signs, one for each of `row`. False for any
/// other, which parse_row reads or refuses.
bool parse_plain_row(std::string_view line, std::span<double> row) {
  const char *at = line.data(), *const end = at + line.size();
  for (double& value : row) {
    const auto [cell_end, error] = std::from_chars(at, end, value);
    const bool is_last = &value == &row.back();
    if (error != std::errc() || !std::isfinite(value) || (cell_end == end) != is_last) return false;
    if (is_last) return true;
    if (*cell_end != ',') return false;
    at = cell_end + 1;
  }
  return false;
}

void parse_row(std::string_view line, NumberTable& table, std::string_view header, const Place& place) {
  const std::size_t first = table.values.size();
  table.lines.push_back(place.line);
  table.values.resize(first + table.columns);
  if (parse_plain_row(line, std::span(table.values).subspan(first))) return;
  if (const std::size_t found = count_columns(line); found != table.columns)
    place.refuse("found " + std::to_string(found) + " columns, expected " + std::to_string(table.columns) +
                 " (" + one_short_line(std::string(header), kLongestHeader) + "); is the file truncated?");
  for (std::size_t i = 0; i < table.columns; ++i)
    table.values[first + i] = parse_number(cut(line, ','), i, place);
}

}  // namespace

std::optional<double> NumberTable::optional(std::size_t i, std::string_view name) const {
  const auto found = std::ranges::find(optional_columns, name);
  if (found == optional_columns.end()) return std::nullopt;
  return row(i)[columns - static_cast<std::size_t>(optional_columns.end() - found)];
}

void refuse_line(const std::string& name, std::size_t line, const std::string& what) {
  throw UserError(one_line(name + ":" + std::to_string(line) + ": " + what));
}

NumberTable parse_number_csv(std::string_view text, const std::string& name, std::string_view header,
                             const NumberCsvLimits& limits) {
  if (text.size() > limits.max_bytes)
    throw UserError(name + ": larger than " + std::to_string(limits.max_bytes >> 20) + " MiB; split it");
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // the byte order mark that spreadsheets write

  NumberTable table;
  table.columns = count_columns(header);
  std::string whole_header(header);
  bool header_seen = false;
  char separator = ',';
  std::size_t line_number = 0;
  while (!text.empty()) {
    const std::string_view line = trimmed(cut(text, '\n'));
    const Place place{name, ++line_number};
    if (line.empty() || line.front() == '#') continue;
    if (!header_seen) {
      if (has_tabs(line)) separator = '\t';
      const std::string names = plain_line(line, separator);
      const bool is_same =
          small_letters(names.substr(0, header.size())) == small_letters(std::string(header));
      const std::string found = is_same ? whole_header + small_letters(names.substr(header.size())) : names;
      table.optional_columns = find_optional(found, header, limits.optional_columns);
      table.columns += table.optional_columns.size();
      for (const std::string& column : table.optional_columns) whole_header += "," + column;
      check_header(found, whole_header, place);
      header_seen = true;
      const std::size_t rows = std::min(most_rows(text, table.columns), limits.max_rows);
      table.lines.reserve(rows);
      table.values.reserve(rows * table.columns);
      continue;
    }
    if (table.rows() == limits.max_rows)
      place.refuse("more than " + std::to_string(limits.max_rows) + " rows; split the file");
    if (separator == ',' && line.find('"') == line.npos)
      parse_row(line, table, whole_header, place);
    else
      parse_row(plain_line(line, separator), table, whole_header, place);
  }
  if (!header_seen)
    throw UserError(name + ":1: the file is empty; its first line must be " + std::string(header));
  if (table.rows() == 0 && !limits.may_be_empty)
    refuse_line(name, line_number, "no rows after the header; add at least one");
  return table;
}

std::string csv_header(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty()) {
    const std::string_view line = trimmed(cut(text, '\n'));
    if (!line.empty() && line.front() != '#')
      return small_letters(plain_line(line, has_tabs(line) ? '\t' : ','));
  }
  return {};
}

NumberTable load_number_csv(const std::filesystem::path& file, std::string_view header,
                            const NumberCsvLimits& limits) {
  return parse_number_csv(load_csv_text(file, header, limits.max_bytes), file.string(), header, limits);
}

std::string load_csv_text(const std::filesystem::path& file, std::string_view header, std::size_t max_bytes) {
  const std::string name = file.string();
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  refuse_denied_folder(file);
  if (!std::filesystem::exists(status))
    throw UserError(name + ": no such file; give a CSV of " + std::string(header));
  if (!std::filesystem::is_regular_file(status))
    throw UserError(name + ": not a file; give a CSV of " + std::string(header));
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!error && size > max_bytes)
    throw UserError(name + ": larger than " + std::to_string(max_bytes >> 20) + " MiB; split it");
  std::ifstream in(file, std::ios::binary);
  std::string text(error ? 0 : static_cast<std::size_t>(size), '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (error || !in) throw UserError(name + ": cannot be read; check its permissions");
  return text;
}

void append_csv_row(std::string& out, std::span<const double> row) {
  std::array<char, 32> buffer;  // a double takes at most 24
  for (std::size_t i = 0; i < row.size(); ++i) {
    if (i) out += ',';
    const auto end =
        std::to_chars(buffer.data(), buffer.data() + buffer.size(), row[i], std::chars_format::general, 17);
    out.append(buffer.data(), end.ptr);
  }
}

}  // namespace brachy
