#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace brachy {

/// A text file that rows are added to. They wait here until flush(), or until there is a megabyte of them, and then go by one
/// write(2): kill −9 leaves whole rows. Where one cannot be written (full disk) the file ends with the whole row before it,
/// all later ones are left out, and failure() says why: what others read stays readable, and the caller's work goes on.
/// Threads: one.
class RowFile {
 public:
  /// Whether a file that is there is replaced or added to.
  enum class Start { kAnew, kGoOn };

  /// An empty file begins with the line `header`. Throws UserError where the file cannot be made.
  RowFile(const std::filesystem::path& file, Start start, std::string_view header);
  ~RowFile();  ///< flushes
  RowFile(const RowFile&) = delete;
  RowFile& operator=(const RowFile&) = delete;

  void add(std::string_view row);  ///< without its line end
  void flush();

  /// Added and, so far as is known, written; the header is none.
  std::uint64_t rows() const { return rows_; }
  bool has_failed() const { return failure_ != 0; }
  /// "FILE: not all rows could be written: REASON; the first ones stay. …"; empty: nothing failed.
  std::string failure() const;

 private:
  std::string name_;
  int file_ = -1;
  std::uint64_t size_ = 0;  // bytes of whole rows in the file
  std::string waiting_;
  std::uint64_t rows_ = 0;
  int failure_ = 0;  // errno of the first failure
};

}  // namespace brachy
