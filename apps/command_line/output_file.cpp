#include "apps/command_line/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string_view>

#include "core/base/error.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;

/// A device, a FIFO or a socket: it holds nothing that could be lost. /dev/stdout is what it leads to.
bool is_stream(const fs::path& file) {
  std::error_code ignored;
  const fs::file_status status = fs::status(file, ignored);
  const std::string name = file.string();
  return fs::is_character_file(status) || fs::is_fifo(status) || fs::is_socket(status) ||
         name == "/dev/stdout" || name == "/dev/stderr" || name.starts_with("/dev/fd/") ||
         name.starts_with("/proc/self/fd/");
}

bool is_there(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(file, ignored));
}

[[noreturn]] void refuse_existing(const fs::path& file) {
  throw UserError(file.string() + ": exists already; give another name, or --force to overwrite it");
}

[[noreturn]] void refuse_write(const fs::path& file) {
  throw UserError(file.string() + ": cannot be written; check the folder and the free space");
}

/// A new file under a name of its own in the same folder; negative: none can be made.
struct BesideFile {
  int descriptor;
  std::string name;
};
BesideFile open_beside(const fs::path& file) {
  constexpr int kMostLeft = 100;  // of processes that were killed
  for (int n = 0; n < kMostLeft; ++n) {
    const std::string name =
        file.string() + ".writing" + std::to_string(::getpid()) + "-" + std::to_string(n);
    const int made = ::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (made >= 0 || errno != EEXIST) return {made, name};
  }
  return {-1, {}};
}

void write_stream(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) refuse_write(file);
}

}  // namespace

void write_text(const fs::path& file, const std::string& text, bool force) {
  if (is_stream(file)) return write_stream(file, text);
  const auto [made, other] = open_beside(file);
  if (made < 0) refuse_write(file);
  bool is_whole = true;
  for (std::string_view left = text; is_whole && !left.empty();) {
    const ssize_t n = ::write(made, left.data(), left.size());
    is_whole = n > 0 || (n < 0 && errno == EINTR);
    if (n > 0) left.remove_prefix(static_cast<std::size_t>(n));
  }
  is_whole = ::close(made) == 0 && is_whole;
  // A hard link fails where the name is taken; a file system without them has only the look before.
  const bool is_new = is_whole && !force && ::link(other.c_str(), file.c_str()) == 0;
  const int reason = errno;
  if (is_new || !is_whole) {
    ::unlink(other.c_str());
    if (!is_whole) refuse_write(file);
    return;
  }
  if (!force && (reason == EEXIST || is_there(file))) {
    ::unlink(other.c_str());
    refuse_existing(file);
  }
  if (::rename(other.c_str(), file.c_str()) == 0) return;
  ::unlink(other.c_str());
  refuse_write(file);
}

void check_output(const std::optional<fs::path>& file, bool force) {
  if (!file || is_stream(*file)) return;
  const auto folder = file->has_parent_path() ? file->parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored))
    throw UserError(file->string() + ": cannot be written; there is no folder " + folder.string());
  if (fs::is_directory(*file, ignored)) throw UserError(file->string() + ": is a folder; name a file in it");
  if (!force && is_there(*file)) refuse_existing(*file);
}

void check_is_no_input(const fs::path& out, const std::vector<std::optional<fs::path>>& inputs) {
  for (const auto& input : inputs) {
    std::error_code ignored;
    if (input && fs::equivalent(out, *input, ignored))
      throw UserError(out.string() + ": is an input; give the output another name");
  }
}

}  // namespace brachy
