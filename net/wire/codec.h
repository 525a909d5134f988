#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>

#include "net/wire/byte_io.h"
#include "net/wire/messages.h"

/// Bytes to messages and back: pure functions, no socket, no clock, any thread. Decoding takes untrusted input: it
/// never reads outside it, throws nothing but std::bad_alloc, and holds at most a small multiple of the input in
/// memory. On anything but kGood the output's content is unspecified (but destructible and reusable).
namespace brachy::net {

struct DecodeResult {
  enum class Status { kGood, kBad, kNeedMore };
  Status status = Status::kGood;
  ErrorCode code = ErrorCode::kProtocol;  ///< with kBad: what to send to the peer
  std::string_view reason;                ///< with kBad: why; a literal

  static DecodeResult good() { return {}; }
  static DecodeResult bad(std::string_view reason, ErrorCode code = ErrorCode::kProtocol) {
    return {Status::kBad, code, reason};
  }
  static DecodeResult need_more() { return {Status::kNeedMore, ErrorCode::kProtocol, {}}; }
  /// The result of reading a body to its end: bad where bytes were missing, left over, or refused.
  static DecodeResult of(ByteReader& reader) {
    const std::string_view reason_if_any = reader.finish();
    return reason_if_any.empty() ? good() : bad(reason_if_any);
  }
  bool is_good() const { return status == Status::kGood; }
  bool is_bad() const { return status == Status::kBad; }
};

/// Appends kHeaderSize bytes.
void encode_header(const Header& header, Bytes& out);

/// Reads a header from the start of `bytes`. Bad as soon as one byte of the magic differs; kNeedMore below
/// kHeaderSize bytes; bad for another version or a body longer than `max_body_bytes`.
DecodeResult decode_header(std::span<const std::byte> bytes, std::uint32_t max_body_bytes, Header& header);

/// A struct of net/wire/messages.h.
template <class T>
concept WireMessage = std::same_as<decltype(T::kType), const MessageType>;

/// Appends the body alone. Too long texts are cut, ill-formed ones repaired. Precondition of the mesh messages,
/// asserted: array sizes agree with each other (positions with ranges, ranges with point_count). Defined in
/// net/wire/*_codec.cpp and net/requests, from the message's list of fields (net/wire/fields.h).
template <WireMessage Message>
void encode_body(const Message& message, Bytes& out);

/// The whole body must be there: a body that ends early is bad, as are bytes left over.
template <WireMessage Message>
DecodeResult decode_body(std::span<const std::byte> body, Message& message);

/// A body that several connections send.
template <WireMessage Message>
std::shared_ptr<const Bytes> encoded_body(const Message& message) {
  Bytes body;
  encode_body(message, body);
  return std::make_shared<const Bytes>(std::move(body));
}

/// Appends header and body.
template <class Message>
void encode(const Message& message, std::uint64_t sequence, std::int64_t stamp_ns, Bytes& out) {
  Bytes body;
  encode_body(message, body);
  encode_header(
      {kProtocolVersion, Message::kType, 0, static_cast<std::uint32_t>(body.size()), sequence, stamp_ns},
      out);
  out.insert(out.end(), body.begin(), body.end());
}

/// FNV-1a (64 bit) over surface_vertex_count, point and triangle counts, triangles and rest positions as TOPOLOGY
/// lays them out.
std::uint64_t topology_hash(const TopologyMessage& message);

}  // namespace brachy::net
