#include "apps/session/session_states.h"

#include <fmt/format.h>
#include <zlib.h>

#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>

#include "core/base/error.h"

namespace brachy {
namespace {

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

/// Time of a file in the folder; nullopt: it is none of ours.
std::optional<double> time_of(const std::string& file) {
  const std::string name = file.substr(0, file.rfind('.'));
  double t_s = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), t_s);
  if (!file.ends_with(".bin") || error != std::errc() || end != name.data() + name.size())
    return std::nullopt;
  return t_s;
}

}  // namespace

void write_session_state(const SessionFolder& session, double t_s, std::span<const std::byte> bytes) {
  StateHeader header;
  header.size = bytes.size();
  header.checksum = checksum_of(bytes);
  std::vector<std::byte> file(sizeof header + compressBound(bytes.size()));
  uLongf size = file.size() - sizeof header;
  std::memcpy(file.data(), &header, sizeof header);
  compress2(reinterpret_cast<Bytef*>(file.data() + sizeof header), &size, zlib_bytes(bytes), bytes.size(),
            Z_BEST_SPEED);
  file.resize(sizeof header + size);
  session.make_folder(kStatesFolder).replace(fmt::format("{:09.3f}.bin", t_s), file);
}

SessionState load_session_state(const SessionFolder& session, double t_s) {
  SessionState state{-INFINITY, {}};
  std::string newest;
  const std::optional<SessionFolder> states = session.find_folder(kStatesFolder);
  if (states)
    for (const std::string& name : states->names()) {
      const std::optional<double> at = time_of(name);
      if (!at || *at > t_s || *at < state.t_s) continue;
      state.t_s = *at;
      newest = name;
    }
  if (newest.empty())
    throw UserError(
        fmt::format("{}: has no state from {} s or earlier to start from; sessions keep one every {} s",
                    session.path_of(kStatesFolder).string(), t_s, kStatePeriodS));
  const std::string damaged = states->path_of(newest).string() + ": is damaged; start from an earlier one";
  const std::string file = states->read(newest).value_or("");
  StateHeader header;
  if (file.size() < sizeof header) throw UserError(damaged);
  std::memcpy(&header, file.data(), sizeof header);
  if (header.magic != kStateMagic || header.size > kMostStateBytes) throw UserError(damaged);
  const std::string_view packed = std::string_view(file).substr(sizeof header);
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
