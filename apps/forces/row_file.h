#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "apps/forces/open_file.h"

namespace brachy {

/// A text file to which rows are added. They are buffered until flush(), or up to a megabyte, and then written by one
/// write(2): kill −9 leaves whole rows. Where a row cannot be written (full disk) the file ends with the whole row
/// before it, later rows are dropped, and failure() has the reason: the file stays readable, and the caller can
/// continue. Threads: one.
class RowFile {
 public:
  /// What becomes of an existing file: it is refused, replaced, or appended to. A device or a FIFO is written to.
  enum class Start { kNew, kAnew, kGoOn };

  /// An empty file begins with the line `header`. Throws UserError where the file cannot be created.
  RowFile(const std::filesystem::path& file, Start start, std::string_view header);
  /// Appends to an open file, whose name in errors is `name`.
  RowFile(OpenFile file, std::string name, std::string_view header);
  ~RowFile();  ///< flushes
  RowFile(const RowFile&) = delete;
  RowFile& operator=(const RowFile&) = delete;

  void add(std::string_view row);  ///< without its line end
  void flush();

  /// Rows added and, as far as known, written; without the header.
  std::uint64_t rows() const { return rows_; }
  bool has_failed() const { return failure_ != 0; }
  /// "FILE: not all rows could be written: REASON; the first ones are kept. …"; empty: nothing failed.
  std::string failure() const;

 private:
  std::string name_;
  OpenFile file_;
  std::uint64_t size_ = 0;  // bytes of whole rows in the file
  std::string waiting_;
  std::uint64_t rows_ = 0;
  int failure_ = 0;  // errno of the first failure
};

}  // namespace brachy
