#include "apps/session/sha256.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <vector>

#include "apps/forces/open_file.h"
#include "core/base/error.h"

namespace brachy {
namespace {

class Sha256 {
 public:
  Sha256() : context_(EVP_MD_CTX_new(), &EVP_MD_CTX_free) {
    if (!context_ || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1)
      throw std::runtime_error("OpenSSL has no SHA-256");
  }
  void add(std::string_view bytes) { EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()); }
  std::string text() {
    std::array<unsigned char, 32> digest{};
    EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr);
    std::string hex;
    for (const unsigned char byte : digest) hex += fmt::format("{:02x}", byte);
    return hex;
  }

 private:
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context_;
};

}  // namespace

std::string sha256_of(std::string_view bytes) {
  Sha256 sum;
  sum.add(bytes);
  return sum.text();
}

FileDigest digest_of_file(const std::filesystem::path& name) {
  const OpenFile file(::open(name.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  struct stat about {};
  if (!file.is_open() || ::fstat(file.get(), &about) != 0)
    throw UserError(name.string() + ": cannot be read: " + std::strerror(errno) + "; check the path");
  if (!S_ISREG(about.st_mode)) throw UserError(name.string() + ": is not a file; name one");
  Sha256 sum;
  FileDigest digest;
  std::vector<char> piece(std::size_t{1} << 20);
  for (;;) {
    const ssize_t n = ::read(file.get(), piece.data(), piece.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw UserError(name.string() + ": cannot be read to its end: " + std::strerror(errno));
    if (n == 0) break;
    sum.add({piece.data(), static_cast<std::size_t>(n)});
    digest.bytes += static_cast<std::uint64_t>(n);
  }
  digest.sha256 = sum.text();
  return digest;
}

}  // namespace brachy
