#include "net/access/token_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <set>

#include "core/base/error.h"

namespace brachy::net {
namespace {

/// An open file, closed at the end.
class File {
 public:
  File(const std::filesystem::path& path, int flags, mode_t mode)
      : descriptor_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  ~File() {
    if (is_open()) ::close(descriptor_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  bool is_open() const { return descriptor_ >= 0; }
  int get() const { return descriptor_; }

 private:
  int descriptor_;
};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& why) {
  throw UserError(file.string() + ": " + why);
}

std::string make_one(const std::filesystem::path& file) {
  return "make one with: brachy token " + file.string();
}

}  // namespace

Token load_token(const std::filesystem::path& path) {
  const File file(path, O_RDONLY | O_NONBLOCK, 0);  // O_NONBLOCK: do not wait for the writer of a pipe
  if (!file.is_open()) {
    if (errno == ENOENT) refuse(path, "no such token file; " + make_one(path));
    refuse(path, std::string("the token file cannot be read: ") + std::strerror(errno));
  }
  struct stat about {};
  if (::fstat(file.get(), &about) != 0 || !S_ISREG(about.st_mode))
    refuse(path, "is not a regular file: a token is a file of 32 bytes; " + make_one(path));
  if (about.st_uid != ::geteuid())
    refuse(path, "belongs to another user: chown it, or make a token of your own");
  if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    refuse(path, "other users may read this token: chmod 600 " + path.string());
  Token token{};
  char one_more = 0;
  if (::read(file.get(), token.data(), token.size()) != static_cast<ssize_t>(token.size()) ||
      ::read(file.get(), &one_more, 1) != 0)
    refuse(path, "does not hold a token, which is 32 bytes; " + make_one(path));
  // Of 32 random bytes fewer than this differ once in 10^20 files.
  constexpr std::size_t kLeastDistinct = 12;
  if (std::set<std::byte>(token.begin(), token.end()).size() < kLeastDistinct)
    refuse(path, "is no token: its bytes can be guessed, because they are hardly random; " + make_one(path));
  return token;
}

void make_token(const std::filesystem::path& path) {
  const File file(path, O_WRONLY | O_CREAT | O_EXCL, S_IRUSR | S_IWUSR);
  if (!file.is_open()) {
    if (errno == EEXIST) refuse(path, "exists already: give another name, nothing is overwritten");
    refuse(path, std::string("cannot be made: ") + std::strerror(errno));
  }
  Token token{};
  if (::getentropy(token.data(), token.size()) != 0 ||
      ::write(file.get(), token.data(), token.size()) != static_cast<ssize_t>(token.size())) {
    const int why = errno;
    ::unlink(path.c_str());
    refuse(path, std::string("cannot be written: ") + std::strerror(why));
  }
}

std::string to_hex(const Token& token) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const std::byte byte : token) {
    hex += kDigits[std::to_integer<unsigned>(byte) >> 4];
    hex += kDigits[std::to_integer<unsigned>(byte) & 15];
  }
  return hex;
}

std::optional<Token> from_hex(std::string_view hex) {
  Token token{};
  if (hex.size() != 2 * token.size()) return std::nullopt;
  for (std::size_t i = 0; i < token.size(); ++i) {
    unsigned value = 0;
    const char* first = hex.data() + 2 * i;
    if (std::from_chars(first, first + 2, value, 16).ptr != first + 2) return std::nullopt;
    token[i] = static_cast<std::byte>(value);
  }
  return token;
}

}  // namespace brachy::net
