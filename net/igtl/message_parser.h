#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "net/igtl/messages.h"
#include "net/wire/byte_io.h"

namespace brachy::net::igtl {

/// What came next in a stream.
enum class Parsed {
  kNeedMore,   ///< nothing whole yet
  kMessage,    ///< one that is_read(), its CRC right
  kSkipped,    ///< one that is not read, or far too long for its type: its body is thrown away as it comes
  kWrongCrc,   ///< dropped; the stream goes on
  kMalformed,  ///< dropped: the sizes in its extended header cannot be; the stream goes on
  kLost,       ///< no OpenIGTLink header, or a body beyond all reason: where the next one begins is not known
};

/// A byte stream cut into OpenIGTLink messages: feed bytes as they come, in pieces of any size, and take messages until
/// it wants more. After kLost it stays so and takes no more bytes. Pure: no socket, no clock. Memory: at most
/// kMaxBodyBytes, a header and one piece, and only for bytes that have come.
class MessageParser {
 public:
  /// What is_read() has small bodies; the room is for metadata.
  static constexpr std::uint64_t kMaxBodyBytes = 64 * 1024;
  /// Of what is skipped: an image or a volume that a client sends to whoever is there.
  static constexpr std::uint64_t kMaxSkippedBytes = 1 << 30;

  struct Message {
    Header header;
    std::span<const std::byte> content;  ///< valid until the next call of feed()
    std::span<const std::byte> metadata_header, metadata;

    /// nullopt: header version 1, or no such key.
    std::optional<std::string_view> find_metadata(std::string_view key) const;
  };

  /// Precondition: next() has answered kNeedMore (or kLost) since the last feed, or the buffer grows.
  void feed(std::span<const std::byte> bytes);
  /// With all answers but kNeedMore message.header is that of the message; its content only with kMessage.
  Parsed next(Message& message);

  /// Whether, after kNeedMore, part of a message that is kept has come. (One that is skipped may take its time.)
  bool has_part() const { return consumed_ < buffer_.size(); }
  std::size_t allocated_bytes() const { return buffer_.capacity(); }

 private:
  Parsed open(std::span<const std::byte> body, Message& message) const;

  Bytes buffer_;
  std::size_t consumed_ = 0;   // of buffer_
  std::uint64_t to_skip_ = 0;  // bytes that have not come yet
  bool is_lost_ = false;
};

}  // namespace brachy::net::igtl
