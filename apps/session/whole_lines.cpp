#include "apps/session/whole_lines.h"

#include <algorithm>
#include <fstream>

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr std::uintmax_t kLongestLine = 8192;  // bytes; rows have fewer than 600

/// The file's last bytes, enough for two lines.
std::string tail_of(const std::filesystem::path& file, std::uintmax_t& size) {
  std::error_code error;
  size = std::filesystem::file_size(file, error);
  const std::uintmax_t count = error ? 0 : std::min(size, 2 * kLongestLine);
  std::string tail(static_cast<std::size_t>(count), '\0');
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(size - count));
  in.read(tail.data(), static_cast<std::streamsize>(count));
  if (error || !in) throw UserError(file.string() + ": cannot be read; check its permissions");
  return tail;
}

}  // namespace

std::string text_of_file(const std::filesystem::path& file) {
  std::error_code failed;
  const std::uintmax_t size = std::filesystem::file_size(file, failed);
  std::string text(failed ? 0 : static_cast<std::size_t>(size), '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max(in.gcount(), std::streamsize{0})));
  return text;
}

bool truncate_partial_line(const std::filesystem::path& file) {
  std::uintmax_t size = 0;
  const std::string tail = tail_of(file, size);
  if (tail.empty() || tail.back() == '\n') return false;
  const std::size_t end = tail.find_last_of('\n');
  if (end == tail.npos && size > tail.size())
    throw UserError(file.string() + ": not a file that brachyd wrote: its last line has no line break");
  std::error_code error;
  std::filesystem::resize_file(file, size - tail.size() + (end == tail.npos ? 0 : end + 1), error);
  if (error) throw UserError(file.string() + ": cannot be repaired: " + error.message());
  return true;
}

std::string last_line(const std::filesystem::path& file) {
  std::uintmax_t size = 0;
  std::string tail = tail_of(file, size);
  if (!tail.empty() && tail.back() == '\n') tail.pop_back();
  const std::size_t start = tail.find_last_of('\n');
  return start == tail.npos ? tail : tail.substr(start + 1);
}

}  // namespace brachy
