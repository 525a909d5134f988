#include "tests/fuzz/message_script.h"

#include <algorithm>

namespace brachy::fuzz {

net::Bytes next_message(Script& script, std::uint64_t sequence) {
  net::Header header;
  header.type = static_cast<net::MessageType>(script.u8());
  const std::uint8_t flaws = script.u8();
  const auto body = script.piece();
  header.version = static_cast<std::uint16_t>(net::kProtocolVersion + (flaws & kWrongVersion));
  header.length = static_cast<std::uint32_t>(body.size()) + (flaws & kWrongLength);
  header.sequence = sequence + (flaws & kWrongSequence);
  header.stamp_ns = static_cast<std::int64_t>(1'000'000 * sequence);
  net::Bytes message;
  net::encode_header(header, message);
  message.insert(message.end(), body.begin(), body.end());
  return message;
}

net::Bytes ServerScript::next() {
  using namespace net;
  constexpr std::size_t kHashBytes = 8;  // a body of either begins with it
  Bytes message = next_message(script_, ++sequence_);
  const auto body = std::span<const std::byte>(message).subspan(kHeaderSize);
  Header header;
  const bool is_good = decode_header(message, 1 << 20, header).is_good();
  if (!is_good || body.size() < kHashBytes) return message;
  TopologyMessage topology;
  const bool is_topology = header.type == MessageType::kTopology;
  if (is_topology && decode_body(body, topology).is_good()) hash_ = topology_hash(topology);
  if (!is_topology && header.type != MessageType::kFrame) return message;
  Bytes hash;
  ByteWriter(hash).u64(hash_);
  std::ranges::copy(hash, message.begin() + kHeaderSize);
  return message;
}

}  // namespace brachy::fuzz
