#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "net/wire/codec.h"

/// A session on a broker: wire messages cut into chunks that fit the broker's payload (net/NATS.md). Pure: no socket,
/// no clock.
namespace brachy::net {

constexpr std::uint32_t kChunkMagic = 0x4E435242;  ///< bytes 42 52 43 4E, "BRCN"
constexpr std::uint16_t kChunkVersion = 1;
constexpr std::size_t kChunkHeaderSize = 40;

/// The header of each chunk.
struct ChunkHeader {
  std::uint64_t publisher = 0;  ///< a random number, drawn when the publisher starts
  std::uint64_t epoch = 0;      ///< of that publisher, ascending: each begins with WELCOME and is complete
  std::uint64_t sequence = 0;   ///< of the message in the epoch: 1, 2, 3, …
  std::uint32_t length = 0;     ///< bytes of the message, its header included
  std::uint32_t offset = 0;     ///< of this chunk's bytes in it
};

/// Cuts a message into payloads of at most `max_payload` bytes and passes each to `send`, until one returns false.
/// Returns whether all were sent; false too where `max_payload` is too small for a chunk. `chunk` is a buffer for them.
bool send_chunks(const ChunkHeader& message, std::span<const std::byte> header,
                 std::span<const std::byte> body, std::size_t max_payload, Bytes& chunk,
                 const std::function<bool(std::span<const std::byte>)>& send);

/// Chunks to messages, from untrusted payloads. An epoch is taken from its first chunk on, in order. Anything that is
/// not a chunk, repeats one or belongs to another epoch is ignored; where a chunk is missing, the rest of the epoch
/// is ignored too. Memory: the largest message allowed, and only for bytes received.
class ChunkAssembler {
 public:
  enum class Taken {
    kLeftOut,  ///< ignored
    kPart,     ///< part of an incomplete message
    kMessage,  ///< message() is complete
    kLost,     ///< a chunk before it is missing: the epoch is lost
  };
  struct Message {
    ChunkHeader chunk;  ///< of its last one
    Header header;
    std::span<const std::byte> body;  ///< valid until the next call
  };

  explicit ChunkAssembler(std::uint32_t max_message_bytes) : max_bytes_(max_message_bytes) {}

  Taken take(std::span<const std::byte> payload);
  const Message& message() const { return message_; }  ///< precondition: take() has just returned kMessage

  /// Whether everything is ignored until a new epoch begins.
  bool is_waiting() const { return is_waiting_; }
  /// Gives up the epoch: a message was invalid, or chunks may be missing.
  void lose() { is_waiting_ = true; }

  std::uint64_t left_out() const { return left_out_; }  ///< chunks
  std::size_t allocated_bytes() const { return bytes_.capacity(); }

 private:
  Taken leave_out();
  bool begins_epoch(const ChunkHeader& chunk) const;

  const std::uint32_t max_bytes_;
  Bytes bytes_;  // of the incomplete message
  std::uint64_t publisher_ = 0, epoch_ = 0;
  std::uint64_t next_sequence_ = 1;
  std::uint32_t length_ = 0;  // of that message
  bool is_waiting_ = true, has_epoch_ = false, is_whole_ = false;
  Message message_;
  std::uint64_t left_out_ = 0;
};

}  // namespace brachy::net
