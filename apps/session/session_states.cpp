#include "apps/session/session_states.h"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <charconv>
#include <cstring>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "core/base/error.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;

constexpr std::array<char, 8> kStateMagic = {'B', 'R', 'S', 'T', 'A', 'T', 'E', '1'};
constexpr std::uint64_t kMostStateBytes = 1ull << 32;  // a header that says more is damaged

struct StateHeader {
  std::array<char, 8> magic = kStateMagic;
  std::uint64_t size = 0;  // of the state, uncompressed
  std::uint64_t checksum = 0;
};

const Bytef* zlib_bytes(std::span<const std::byte> bytes) {
  return reinterpret_cast<const Bytef*>(bytes.data());
}

std::uint64_t checksum_of(std::span<const std::byte> bytes) {
  return crc32_z(crc32_z(0, nullptr, 0), zlib_bytes(bytes), bytes.size());
}

fs::path folder_of(const fs::path& session) {
  return session / "states";
}

/// Time of a file in the folder; nullopt: it is none of ours.
std::optional<double> time_of(const fs::path& file) {
  const std::string name = file.stem().string();
  double t_s = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), t_s);
  if (file.extension() != ".bin" || error != std::errc() || end != name.data() + name.size())
    return std::nullopt;
  return t_s;
}

}  // namespace

void write_session_state(const fs::path& session, double t_s, std::span<const std::byte> bytes) {
  const fs::path file = folder_of(session) / fmt::format("{:09.3f}.bin", t_s),
                 part = fs::path(file) += ".part";
  StateHeader header;
  header.size = bytes.size();
  header.checksum = checksum_of(bytes);
  std::vector<Bytef> packed(compressBound(bytes.size()));
  uLongf size = packed.size();
  compress2(packed.data(), &size, zlib_bytes(bytes), bytes.size(), Z_BEST_SPEED);
  std::error_code failed;
  fs::create_directories(folder_of(session), failed);
  std::ofstream out(part, std::ios::binary | std::ios::trunc);
  out.write(reinterpret_cast<const char*>(&header), sizeof header);
  out.write(reinterpret_cast<const char*>(packed.data()), static_cast<std::streamsize>(size));
  out.close();
  if (out) fs::permissions(part, fs::perms::owner_read | fs::perms::owner_write, failed);
  if (out) fs::rename(part, file, failed);
  if (out && !failed) return;
  fs::remove(part, failed);
  throw std::runtime_error(file.string() + ": cannot be written");
}

SessionState load_session_state(const fs::path& session, double t_s) {
  SessionState state{-INFINITY, {}};
  fs::path file;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder_of(session), none)) {
    const std::optional<double> at = time_of(entry.path());
    if (!at || *at > t_s || *at < state.t_s) continue;
    state.t_s = *at;
    file = entry.path();
  }
  if (file.empty())
    throw UserError(
        fmt::format("{}: has no state from {} s or earlier to start from; sessions keep one every {} s",
                    folder_of(session).string(), t_s, kStatePeriodS));
  const std::string damaged = file.string() + ": is damaged; start from an earlier one";
  std::ifstream in(file, std::ios::binary);
  StateHeader header;
  in.read(reinterpret_cast<char*>(&header), sizeof header);
  if (!in || header.magic != kStateMagic || header.size > kMostStateBytes) throw UserError(damaged);
  const std::vector<char> packed{std::istreambuf_iterator<char>(in), {}};
  if (header.size > 1100 * packed.size()) throw UserError(damaged);  // deflate's best is 1032
  state.bytes.resize(header.size);
  uLongf size = header.size;
  const int result = uncompress(reinterpret_cast<Bytef*>(state.bytes.data()), &size,
                                reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (result != Z_OK || size != header.size || checksum_of(state.bytes) != header.checksum)
    throw UserError(damaged);
  return state;
}

}  // namespace brachy
