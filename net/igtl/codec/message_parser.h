#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "net/igtl/codec/messages.h"
#include "net/wire/byte_io.h"

namespace brachy::net::igtl {

/// The next item of a stream.
enum class Parsed {
  kNeedMore,   ///< no complete message yet
  kMessage,    ///< one that is_read(), with the right CRC or with none (0)
  kSkipped,    ///< one that is not read, or too long for its type: its body is discarded as it arrives
  kWrongCrc,   ///< dropped; the stream goes on
  kMalformed,  ///< dropped: the sizes in its extended header are impossible; the stream goes on
  kLost,       ///< no OpenIGTLink header, or an absurd body size: the start of the next message is not known
};

/// A byte stream cut into OpenIGTLink messages: feed bytes as they arrive, in pieces of any size, and take messages
/// until it needs more. After kLost it stays so and takes no more bytes. Pure: no socket, no clock. Memory: at most
/// kMaxBodyBytes, a header and one piece, and only for bytes received.
class MessageParser {
 public:
  /// Messages that is_read() have small bodies; the rest allows for metadata.
  static constexpr std::uint64_t kMaxBodyBytes = 64 * 1024;
  /// Some programs write the protocol's version, 3, into the header, whose own is 2 then.
  static constexpr std::uint16_t kNewestVersion = 3;
  /// Limit of skipped messages: an image or a volume that a client broadcasts.
  static constexpr std::uint64_t kMaxSkippedBytes = 1 << 30;

  struct Message {
    Header header;
    std::span<const std::byte> content;  ///< valid until the next call of feed()
    std::span<const std::byte> metadata_header, metadata;

    /// nullopt: header version 1, or no such key.
    std::optional<std::string_view> find_metadata(std::string_view key) const;
  };

  /// Precondition: next() has returned kNeedMore (or kLost) since the last feed, or the buffer grows.
  void feed(std::span<const std::byte> bytes);
  /// Unless kNeedMore is returned, message.header is that of the message; its content only with kMessage.
  Parsed next(Message& message);

  /// Whether, after kNeedMore, part of a message that is read has arrived. (Skipped messages may take any time.)
  bool has_part() const { return consumed_ < buffer_.size(); }
  std::size_t allocated_bytes() const { return buffer_.capacity(); }

 private:
  Parsed open(std::span<const std::byte> body, Message& message) const;

  Bytes buffer_;
  std::size_t consumed_ = 0;   // of buffer_
  std::uint64_t to_skip_ = 0;  // bytes not received yet
  bool is_lost_ = false;
};

}  // namespace brachy::net::igtl
