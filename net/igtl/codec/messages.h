#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/rigid_transform.h"

/// OpenIGTLink's messages as far as brachyd supports them: the protocol's documents (openigtlink.org, versions 1 to
/// 3) say what each field means, net/IGTL.md how it is used. All numbers are big-endian on the wire; lengths mm,
/// coordinates RAS.
namespace brachy::net::igtl {

constexpr std::size_t kHeaderSize = 58;  ///< bytes: version, type, device, time, size and CRC of the body
constexpr std::size_t kTypeBytes = 12;   ///< of the type's name in it
constexpr std::size_t kNameBytes = 20;   ///< of the device's, and of all other names
constexpr std::size_t kExtendedHeaderSize =
    12;  ///< bytes with which the body begins from header version 2 on
constexpr std::size_t kTransformBytes = 48;

struct Header {
  std::uint16_t version = 1;  ///< of the header: 1 (protocol 1 and 2) or 2 (protocol 3)
  std::string type;           ///< "TRANSFORM", "GET_STATUS", …
  std::string device;         ///< name of the device or tool; printable
  std::uint64_t timestamp = 0;
  std::uint64_t body_size = 0;
  std::uint64_t crc = 0;  ///< of the body
};

/// The fields of a header that do not follow from the body.
struct Label {
  std::uint16_t version = 1;
  std::string_view device;      ///< cut to kNameBytes
  std::uint64_t timestamp = 0;  ///< to_timestamp()
};

/// Seconds since 1970, UTC, as 32.32 fixed point; 0 = not known.
constexpr std::uint64_t to_timestamp(std::int64_t utc_ns) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  if (utc_ns <= 0) return 0;
  const auto ns = static_cast<std::uint64_t>(utc_ns);
  return (ns / kSecond) << 32 | ((ns % kSecond) << 32) / kSecond;
}
constexpr std::int64_t to_ns(std::uint64_t timestamp) {
  return static_cast<std::int64_t>((timestamp >> 32) * 1'000'000'000 +
                                   ((timestamp & 0xFFFFFFFF) * 1'000'000'000 >> 32));
}

/// Of the protocol's STATUS; those that are used.
enum class StatusCode : std::uint16_t {
  kOk = 1,
  kUnknownError = 2,
  kBusy = 6,
  kOverflow = 8,
  kChecksumError = 9,
  kIllegalInstruction = 12,
  kNotPresent = 16,
  kShutdown = 19,
};

struct Status {
  StatusCode code = StatusCode::kOk;
  /// Of a refused pose its PoseVerdict's; of what the native protocol says by an ERROR that one's code; else 0.
  std::int64_t sub_code = 0;
  std::string name;  ///< short, for programs; cut to kNameBytes
  std::string text;  ///< for people
};

/// One tool of a TDATA.
struct TrackedTool {
  std::string name;
  RigidTransform X;
};

/// What STT_TDATA asks for. The coordinate system it may name does not matter: all is in Naming::frame.
struct StartTracking {
  std::uint32_t resolution_ms = 0;  ///< least time between two TDATA
};

/// Whether a server reads such messages; all others are skipped.
constexpr bool is_read(std::string_view type) {
  constexpr std::string_view kRead[] = {"TRANSFORM",    "GET_TRANS", "GET_TRANSFOR", "GET_POLYDATA",
                                        "GET_STATUS",   "STT_TDATA", "STP_TDATA",    "GET_CAPABIL",
                                        "GET_POINT",    "STRING",    "COMMAND",      "STT_POLYDATA",
                                        "STP_POLYDATA", "GET_IMAGE", "STT_IMAGE",    "STP_IMAGE"};
  for (const std::string_view read : kRead)
    if (type == read) return true;
  return false;
}

}  // namespace brachy::net::igtl
