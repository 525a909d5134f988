#pragma once

#include <cstdint>
#include <span>

#include "net/wire/codec.h"

namespace brachy::net {

/// A byte stream cut into messages: feed bytes as they arrive, in pieces of any size, and take messages until it needs
/// more. Checks each header before it waits for the body, and that sequences run 1, 2, 3, …; after the first bad
/// message it stays bad and takes no more bytes. Pure: no socket, no clock. Memory: at most the limit, a header and
/// one piece, and only for bytes received.
class MessageParser {
 public:
  struct Message {
    Header header;
    std::span<const std::byte> body;  ///< valid until the next call of feed()
  };

  explicit MessageParser(std::uint32_t max_body_bytes) : max_body_bytes_(max_body_bytes) {}

  /// Precondition: next() has returned kNeedMore (or kBad) since the last feed, or the buffer grows.
  void feed(std::span<const std::byte> bytes);
  DecodeResult next(Message& message);
  /// Messages of this one type may be longer from now on.
  void allow(MessageType type, std::uint32_t max_body_bytes) {
    longer_type_ = type;
    longer_bytes_ = max_body_bytes;
  }
  /// As decode_header, with the limit of the message's type.
  DecodeResult read_header(std::span<const std::byte> bytes, Header& header) const;

  std::uint64_t last_sequence() const { return last_sequence_; }
  std::size_t allocated_bytes() const { return buffer_.capacity(); }

 private:
  std::uint32_t max_body_bytes_;
  MessageType longer_type_{};  // none
  std::uint32_t longer_bytes_ = 0;
  Bytes buffer_;
  std::size_t consumed_ = 0;  // of buffer_
  std::uint64_t last_sequence_ = 0;
  DecodeResult bad_;  // kBad once something was
};

}  // namespace brachy::net
