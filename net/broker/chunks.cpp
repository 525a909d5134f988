#include "net/broker/chunks.h"

#include <algorithm>
#include <cassert>

namespace brachy::net {
namespace {

void encode(const ChunkHeader& chunk, Bytes& out) {
  ByteWriter writer(out);
  writer.u32(kChunkMagic);
  writer.u16(kChunkVersion);
  writer.u16(0);
  writer.u64(chunk.publisher);
  writer.u64(chunk.epoch);
  writer.u64(chunk.sequence);
  writer.u32(chunk.length);
  writer.u32(chunk.offset);
}

/// False where it is not a chunk of this version.
bool decode(std::span<const std::byte> payload, ChunkHeader& chunk) {
  ByteReader reader(payload);
  const bool is_ours = reader.u32() == kChunkMagic && reader.u16() == kChunkVersion;
  reader.u16();
  chunk.publisher = reader.u64();
  chunk.epoch = reader.u64();
  chunk.sequence = reader.u64();
  chunk.length = reader.u32();
  chunk.offset = reader.u32();
  return is_ours && reader.ok();
}

}  // namespace

bool send_chunks(const ChunkHeader& message, std::span<const std::byte> header,
                 std::span<const std::byte> body, std::size_t max_payload, Bytes& chunk,
                 const std::function<bool(std::span<const std::byte>)>& send) {
  if (max_payload <= kChunkHeaderSize) return false;
  const std::size_t space = max_payload - kChunkHeaderSize;
  ChunkHeader at = message;
  at.length = static_cast<std::uint32_t>(header.size() + body.size());
  for (std::size_t offset = 0; offset < at.length;) {
    at.offset = static_cast<std::uint32_t>(offset);
    const std::size_t end = std::min<std::size_t>(offset + space, at.length);
    chunk.clear();
    encode(at, chunk);
    for (const auto& [part, begins] : {std::pair{header, std::size_t{0}}, std::pair{body, header.size()}}) {
      const std::size_t from = std::clamp(offset, begins, begins + part.size());
      const std::size_t to = std::clamp(end, begins, begins + part.size());
      const auto piece = part.subspan(from - begins, to - from);
      chunk.insert(chunk.end(), piece.begin(), piece.end());
    }
    if (!send(chunk)) return false;
    offset = end;
  }
  return true;
}

ChunkAssembler::Taken ChunkAssembler::leave_out() {
  ++left_out_;
  return Taken::kLeftOut;
}

// An epoch that was lost, or an earlier one, is not resumed: its first chunk may have been on its way meanwhile.
bool ChunkAssembler::begins_epoch(const ChunkHeader& chunk) const {
  if (chunk.sequence != 1 || chunk.offset != 0) return false;
  return !has_epoch_ || chunk.publisher != publisher_ || chunk.epoch > epoch_;
}

ChunkAssembler::Taken ChunkAssembler::take(std::span<const std::byte> payload) {
  ChunkHeader chunk;
  if (!decode(payload, chunk)) return leave_out();
  const auto piece = payload.subspan(kChunkHeaderSize);
  if (chunk.length < kHeaderSize || chunk.length > max_bytes_ || piece.empty() ||
      piece.size() > chunk.length || chunk.offset > chunk.length - piece.size())
    return leave_out();

  if (is_whole_) bytes_.clear();
  is_whole_ = false;
  if (begins_epoch(chunk)) {
    publisher_ = chunk.publisher;
    epoch_ = chunk.epoch;
    next_sequence_ = 1;
    bytes_.clear();
    is_waiting_ = false;
    has_epoch_ = true;
  }
  if (is_waiting_ || chunk.publisher != publisher_ || chunk.epoch != epoch_) return leave_out();
  const bool came_before =
      chunk.sequence < next_sequence_ || (chunk.sequence == next_sequence_ && chunk.offset < bytes_.size());
  if (came_before) return leave_out();
  const bool goes_on = chunk.sequence == next_sequence_ && chunk.offset == bytes_.size() &&
                       (chunk.offset == 0 || chunk.length == length_);
  if (!goes_on) {
    lose();
    return Taken::kLost;
  }
  length_ = chunk.length;
  bytes_.insert(bytes_.end(), piece.begin(), piece.end());
  if (bytes_.size() < length_) return Taken::kPart;

  const DecodeResult header = decode_header(bytes_, max_bytes_, message_.header);
  if (!header.is_good() || message_.header.length != length_ - kHeaderSize) {
    lose();
    return Taken::kLost;
  }
  is_whole_ = true;
  ++next_sequence_;
  message_.chunk = chunk;
  message_.body = std::span<const std::byte>(bytes_).subspan(kHeaderSize);
  return Taken::kMessage;
}

}  // namespace brachy::net
