#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace brachy {

/// Rows of numbers from a CSV file, with the line number of each (for later errors).
struct NumberTable {
  std::size_t columns = 0;
  std::vector<double> values;                 ///< rows × columns
  std::vector<std::size_t> lines;             ///< of the file, from 1
  std::vector<std::string> optional_columns;  ///< those in the file: the last of `columns`, in its order

  std::size_t rows() const { return lines.size(); }
  std::span<const double> row(std::size_t i) const { return {values.data() + i * columns, columns}; }
  /// Row i's number in optional column `name`, or nothing where the file has no such column.
  std::optional<double> optional(std::size_t i, std::string_view name) const;
};

struct NumberCsvLimits {
  std::size_t max_bytes = std::size_t{1} << 30;
  std::size_t max_rows = 10'000'000;
  std::span<const std::string_view> optional_columns = {};  ///< names
  bool may_be_empty = false;                                ///< accepts a file of the header alone
};

/// Reads a CSV whose first line is `header` (comma-separated names), then any of limits.optional_columns, and whose
/// rows are finite numbers, one per name. As spreadsheets and trackers write them, names may be in capitals, cells in
/// quotes and with blanks about them, and tabs may separate the cells of all lines. Blank lines and lines that start
/// with '#' are skipped; LF or CRLF; a byte order mark is skipped. At least one row, unless limits.may_be_empty.
/// Semicolons are refused: with them, a comma may be a decimal point or not. Errors: UserError "name:line: what; fix".
NumberTable parse_number_csv(std::string_view text, const std::string& name, std::string_view header,
                             const NumberCsvLimits& limits = {});

/// parse_number_csv of a file; UserError also where it is not a readable regular file or is too large.
NumberTable load_number_csv(const std::filesystem::path& file, std::string_view header,
                            const NumberCsvLimits& limits = {});

/// The text of such a file, for parse_number_csv. Errors: as load_number_csv.
std::string load_csv_text(const std::filesystem::path& file, std::string_view header, std::size_t max_bytes);

/// Its first line that is neither blank nor a comment, as parse_number_csv compares it: with commas, in small letters,
/// without quotes and blanks.
std::string csv_header(std::string_view text);

/// Appends "a,b,…" without a line end: 17 significant digits, so that reading gives the same bits.
void append_csv_row(std::string& out, std::span<const double> row);

/// Throws UserError "name:line: what".
[[noreturn]] void refuse_line(const std::string& name, std::size_t line, const std::string& what);

}  // namespace brachy
