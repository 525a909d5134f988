#include "apps/session/session_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "core/base/denied_folder.h"
#include "core/base/error.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;

constexpr int kFolderFlags = O_RDONLY | O_DIRECTORY | O_CLOEXEC;
constexpr std::size_t kLargestBlank = 65536;
constexpr std::size_t kReadPiece = 65536;
constexpr const char* kElsewhere = "; remove it, or give another directory";

std::string cannot_be_written(int reason) {
  return std::string("cannot be written: ") + std::strerror(reason) +
         "; free some space, or give another directory";
}

std::string kind_of(mode_t mode) {
  if (S_ISLNK(mode)) return "a link";
  if (S_ISDIR(mode)) return "a directory";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

/// Why a file is not taken, to be read; empty: it is.
std::string fault_to_read(const struct stat& about, std::uint64_t most_bytes) {
  if (!S_ISREG(about.st_mode)) return "is not a regular file but " + kind_of(about.st_mode) + kElsewhere;
  if (static_cast<std::uint64_t>(about.st_size) > most_bytes)
    return "has more than " + std::to_string(most_bytes / kMegabyte) + " MB, which no session has" +
           kElsewhere;
  return {};
}

/// The same, to be written. Others' rights do not matter here: they are taken away once it is opened.
std::string fault_to_write(const struct stat& about, std::uint64_t most_bytes) {
  if (std::string fault = fault_to_read(about, most_bytes); !fault.empty()) return fault;
  if (about.st_uid != ::geteuid()) return std::string("belongs to another user") + kElsewhere;
  if (about.st_nlink != 1)
    return "has " + std::to_string(about.st_nlink) +
           " names (hard links): what is written here would change the " + "others" + kElsewhere;
  if ((about.st_mode & S_IWUSR) == 0) return "is read-only; chmod u+w, or give another directory";
  return {};
}

std::string folder_fault(const struct stat& about) {
  if (about.st_uid == ::geteuid() || about.st_uid == 0) return {};
  return ::geteuid() == 0
             ? ": belongs to another user, and brachyd drops root's rights over other users' files once it "
               "runs; start "
               "it as that user, or give a directory that root owns"
             : ": belongs to another user, who could exchange what is in it; give a directory of your own";
}

/// "a/b/" is the link itself where it is one, as "a/b".
fs::path without_slash(const fs::path& folder) {
  return folder.has_filename() || !folder.has_parent_path() || folder == folder.root_path()
             ? folder
             : folder.parent_path();
}

/// Bytes at `from`, fewer at the end.
std::string bytes_at(int file, std::uint64_t from, std::size_t count) {
  std::string bytes(count, '\0');
  std::size_t got = 0;
  while (got < count) {
    const ssize_t n = ::pread(file, bytes.data() + got, count - got, static_cast<off_t>(from + got));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    got += static_cast<std::size_t>(n);
  }
  bytes.resize(got);
  return bytes;
}

bool has_only_blanks(std::string_view text) {
  return std::ranges::all_of(text, [](unsigned char c) { return std::isspace(c) != 0; });
}

/// The size of a file of lines up to its last line end, found from its end backwards; 0 of a blank one.
std::uint64_t whole_size(int file, std::uint64_t size) {
  if (size <= kLargestBlank && has_only_blanks(bytes_at(file, 0, static_cast<std::size_t>(size)))) return 0;
  for (std::uint64_t end = size; end > 0;) {
    const std::uint64_t from = end > kReadPiece ? end - kReadPiece : 0;
    const std::string piece = bytes_at(file, from, static_cast<std::size_t>(end - from));
    if (const std::size_t last = piece.rfind('\n'); last != piece.npos) return from + last + 1;
    end = from;
  }
  return 0;
}

bool write_whole(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(file, text.data(), text.size());
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = ENOSPC;
    if (n <= 0) return false;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

}  // namespace

SessionFolder SessionFolder::make(const fs::path& given) {
  const fs::path folder = without_slash(given);
  refuse_denied_folder(folder);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw UserError(folder.string() + ": cannot be created: " + error.message());
  OpenFile opened(::open(folder.c_str(), kFolderFlags | O_NOFOLLOW));
  struct stat about {};
  if (!opened.is_open() && (errno == ELOOP || errno == ENOTDIR))
    throw UserError(folder.string() + ": is a link, or no directory; give the directory itself");
  if (!opened.is_open() || ::fstat(opened.get(), &about) != 0)
    throw UserError(folder.string() + ": no permission to read this folder (" + std::strerror(errno) +
                    "); give another directory");
  if (::faccessat(opened.get(), ".", W_OK | X_OK, AT_EACCESS) != 0)
    throw UserError(folder.string() + ": no permission to write into this folder (" + std::strerror(errno) +
                    "); give another directory");
  if (const std::string fault = folder_fault(about); !fault.empty()) throw UserError(folder.string() + fault);
  return {folder, std::move(opened)};
}

SessionFolder SessionFolder::open(const fs::path& folder) {
  refuse_denied_folder(folder);
  OpenFile opened(::open(folder.c_str(), kFolderFlags));
  if (!opened.is_open())
    throw UserError(folder.string() +
                    (errno == ENOENT || errno == ENOTDIR
                         ? ": no such directory"
                         : ": cannot be read: " + std::string(std::strerror(errno))) +
                    "; give a recording made by `brachy record`, or a session");
  return {folder, std::move(opened)};
}

void SessionFolder::refuse(std::string_view name, const std::string& why) const {
  throw UserError(path_of(name).string() + ": " + why);
}

std::uint64_t SessionFolder::most_bytes_of(std::string_view name) const {
  if (most_bytes_ > 0) return most_bytes_;
  for (const SessionFile& file : kSessionFiles)
    if (name == file.name) return file.most_bytes;
  return name.starts_with(kSessionRecording.name) ? kSessionRecording.most_bytes : kPlanChange.most_bytes;
}

void SessionFolder::lock() const {
  // A file system that cannot lock a directory has only the lock of the ledger.
  if (::flock(at(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw UserError(path_.string() +
                    ": another process records into it; end that process or give another directory");
}

void SessionFolder::check_to_write(std::string_view name) const {
  struct stat about {};
  if (::fstatat(at(), std::string(name).c_str(), &about, AT_SYMLINK_NOFOLLOW) != 0) {
    if (errno == ENOENT) return;
    refuse(name, std::string("cannot be examined: ") + std::strerror(errno));
  }
  if (const std::string fault = fault_to_write(about, most_bytes_of(name)); !fault.empty())
    refuse(name, fault);
}

void SessionFolder::check_all() const {
  for (const SessionFile& file : kSessionFiles) check_to_write(file.name);
  for (const SessionFile& some : {kPlanChange, kSessionRecording})
    for (const std::string& name : names(some.name)) check_to_write(name);
  if (!has(kStatesFolder)) return;
  const SessionFolder states = make_folder(kStatesFolder);
  for (const std::string& name : states.names()) states.check_to_write(name);
}

bool SessionFolder::has(std::string_view name) const {
  struct stat about {};
  return ::fstatat(at(), std::string(name).c_str(), &about, AT_SYMLINK_NOFOLLOW) == 0 || errno != ENOENT;
}

OpenFile SessionFolder::open_to_read(std::string_view name) const {
  // A FIFO without a writer would block.
  OpenFile file(::openat(at(), std::string(name).c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  struct stat about {};
  if (!file.is_open() && errno == ENOENT) return file;
  if (!file.is_open() && errno == ELOOP)
    refuse(name, std::string("is not a regular file but a link") + kElsewhere);
  if (!file.is_open() && errno == ENXIO)
    refuse(name, std::string("is not a regular file but a socket") + kElsewhere);
  if (!file.is_open() || ::fstat(file.get(), &about) != 0)
    refuse(name, std::string("cannot be read: ") + std::strerror(errno) + "; check its permissions");
  if (const std::string fault = fault_to_read(about, most_bytes_of(name)); !fault.empty())
    refuse(name, fault);
  return file;
}

std::optional<std::uint64_t> SessionFolder::size_of(std::string_view name) const {
  const OpenFile file = open_to_read(name);
  struct stat about {};
  if (!file.is_open() || ::fstat(file.get(), &about) != 0) return std::nullopt;
  return static_cast<std::uint64_t>(about.st_size);
}

bool SessionFolder::is_blank(std::string_view name) const {
  const std::optional<std::uint64_t> size = size_of(name);
  return size && *size <= kLargestBlank && has_only_blanks(read(name).value_or(""));
}

std::optional<std::string> SessionFolder::read(std::string_view name) const {
  const std::optional<std::uint64_t> size = size_of(name);
  if (!size) return std::nullopt;
  if (*size > kMostInMemory)
    refuse(name,
           "has more than " + std::to_string(kMostInMemory / kMegabyte) + " MB: too much to be read at once");
  return first_bytes(name, static_cast<std::size_t>(*size));
}

bool SessionFolder::read_lines(std::string_view name,
                               const std::function<void(std::string_view)>& visit) const {
  constexpr std::size_t kPieceBytes = std::size_t{16} << 20;
  const OpenFile file = open_to_read(name);
  if (!file.is_open()) return false;
  std::string rest;
  for (std::uint64_t from = 0;;) {
    const std::string piece = bytes_at(file.get(), from, kPieceBytes);
    if (piece.empty()) break;
    from += piece.size();
    rest += piece;
    const std::size_t whole = whole_lines(rest).size();
    visit(std::string_view(rest).substr(0, whole));
    rest.erase(0, whole);
  }
  return !rest.empty();
}

std::optional<std::string> SessionFolder::first_bytes(std::string_view name, std::size_t count) const {
  const OpenFile file = open_to_read(name);
  if (!file.is_open()) return std::nullopt;
  return bytes_at(file.get(), 0, count);
}

std::optional<std::string> SessionFolder::last_bytes(std::string_view name, std::size_t count) const {
  const OpenFile file = open_to_read(name);
  struct stat about {};
  if (!file.is_open() || ::fstat(file.get(), &about) != 0) return std::nullopt;
  const auto size = static_cast<std::uint64_t>(about.st_size);
  return bytes_at(file.get(), size > count ? size - count : 0, count);
}

std::vector<std::string> SessionFolder::names(std::string_view start) const {
  std::vector<std::string> names;
  DIR* const listing = ::fdopendir(::openat(at(), ".", kFolderFlags));
  if (listing == nullptr) return names;
  while (const dirent* entry = ::readdir(listing)) {
    const std::string_view name = entry->d_name;
    if (name != "." && name != ".." && name.starts_with(start)) names.emplace_back(name);
  }
  ::closedir(listing);
  return names;
}

OpenFile SessionFolder::append_to(std::string_view name) const {
  OpenFile file(::openat(at(), std::string(name).c_str(),
                         O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0600));
  struct stat about {};
  if (!file.is_open()) check_to_write(name);  // says what it is
  if (!file.is_open() || ::fstat(file.get(), &about) != 0)
    refuse(name, std::string("cannot be written: ") + std::strerror(errno) + "; give another directory");
  if (const std::string fault = fault_to_write(about, most_bytes_of(name)); !fault.empty())
    refuse(name, fault);
  // Of an earlier version's file.
  if (::fchmod(file.get(), 0600) != 0)
    refuse(name, std::string("cannot be made private: ") + std::strerror(errno));
  const auto size = static_cast<std::uint64_t>(about.st_size);
  const std::uint64_t whole = whole_size(file.get(), size);
  if (whole < size && ::ftruncate(file.get(), static_cast<off_t>(whole)) != 0)
    refuse(name, std::string("cannot be repaired: ") + std::strerror(errno));
  return file;
}

void SessionFolder::write_new(std::string_view name, std::string_view text) const {
  const OpenFile file = create(name);
  if (write_whole(file.get(), text)) return;
  const int reason = errno;
  ::unlinkat(at(), std::string(name).c_str(), 0);
  refuse(name, cannot_be_written(reason));
}

OpenFile SessionFolder::create(std::string_view name) const {
  OpenFile file(
      ::openat(at(), std::string(name).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!file.is_open()) refuse(name, cannot_be_written(errno));
  return file;
}

void SessionFolder::replace(std::string_view name, std::string_view text) const {
  check_to_write(name);
  const std::string file_name(name), other = "." + file_name + ".writing";
  // Of a process that was killed.
  if (::unlinkat(at(), other.c_str(), 0) != 0 && errno != ENOENT)
    refuse(other, std::string("is in the way: ") + std::strerror(errno) + kElsewhere);
  write_new(other, text);
  if (::renameat(at(), other.c_str(), at(), file_name.c_str()) == 0) return;
  const int reason = errno;
  ::unlinkat(at(), other.c_str(), 0);
  refuse(name, std::string("cannot be written: ") + std::strerror(reason));
}

void SessionFolder::replace(std::string_view name, std::span<const std::byte> bytes) const {
  replace(name, std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

SessionFolder SessionFolder::make_folder(std::string_view name) const {
  const std::string folder_name(name);
  if (::mkdirat(at(), folder_name.c_str(), 0700) != 0 && errno != EEXIST)
    refuse(name, std::string("cannot be created: ") + std::strerror(errno));
  OpenFile folder(::openat(at(), folder_name.c_str(), kFolderFlags | O_NOFOLLOW));
  struct stat about {};
  if (!folder.is_open() || ::fstat(folder.get(), &about) != 0)
    refuse(name, std::string("is not a directory that can be read") + kElsewhere);
  if (const std::string fault = folder_fault(about); !fault.empty())
    throw UserError(path_of(name).string() + fault);
  return {path_of(name), std::move(folder), kSessionState.most_bytes};
}

std::optional<SessionFolder> SessionFolder::find_folder(std::string_view name) const {
  OpenFile folder(::openat(at(), std::string(name).c_str(), kFolderFlags | O_NOFOLLOW));
  if (!folder.is_open()) {
    if (errno == ENOENT) return std::nullopt;
    refuse(name, std::string("is not a directory that can be read") + kElsewhere);
  }
  return SessionFolder(path_of(name), std::move(folder), kSessionState.most_bytes);
}

std::string_view whole_lines(std::string_view text) {
  return text.substr(0, text.rfind('\n') + 1);
}

}  // namespace brachy
