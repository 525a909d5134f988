#include "net/igtl/codec/message_parser.h"

#include <algorithm>

#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/codec.h"
#include "net/igtl/codec/crc64.h"

namespace brachy::net::igtl {

void MessageParser::feed(std::span<const std::byte> bytes) {
  if (is_lost_) return;
  const auto skipped = static_cast<std::size_t>(std::min<std::uint64_t>(to_skip_, bytes.size()));
  to_skip_ -= skipped;
  bytes = bytes.subspan(skipped);
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(consumed_));
  consumed_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

Parsed MessageParser::next(Message& message) {
  if (is_lost_) return Parsed::kLost;
  const auto rest = std::span<const std::byte>(buffer_).subspan(consumed_);
  if (rest.size() < kHeaderSize) return Parsed::kNeedMore;
  message.header = decode_header(rest);
  const std::uint64_t size = message.header.body_size;
  if (message.header.version < 1 || message.header.version > kNewestVersion || size > kMaxSkippedBytes) {
    is_lost_ = true;
    return Parsed::kLost;
  }
  const auto come = rest.subspan(kHeaderSize);
  if (!is_read(message.header.type) || size > kMaxBodyBytes) {
    const auto skipped = static_cast<std::size_t>(std::min<std::uint64_t>(size, come.size()));
    consumed_ += kHeaderSize + skipped;
    to_skip_ = size - skipped;
    return Parsed::kSkipped;
  }
  if (come.size() < size) return Parsed::kNeedMore;
  consumed_ += kHeaderSize + static_cast<std::size_t>(size);
  return open(come.first(static_cast<std::size_t>(size)), message);
}

Parsed MessageParser::open(std::span<const std::byte> body, Message& message) const {
  // 0: the sender computes none, as PLUS by default.
  if (message.header.crc != 0 && crc64(body) != message.header.crc && !body.empty()) return Parsed::kWrongCrc;
  message.content = body;
  message.metadata_header = message.metadata = {};
  if (message.header.version < 2 || body.empty()) return Parsed::kMessage;
  if (body.size() < kExtendedHeaderSize) return Parsed::kMalformed;
  const std::size_t extended = get<std::uint16_t>(body), header = get<std::uint16_t>(body.subspan(2));
  const std::uint64_t metadata = get<std::uint32_t>(body.subspan(4));
  if (extended < kExtendedHeaderSize || extended + header + metadata > body.size()) return Parsed::kMalformed;
  const std::size_t content = body.size() - extended - header - static_cast<std::size_t>(metadata);
  message.content = body.subspan(extended, content);
  message.metadata_header = body.subspan(extended + content, header);
  message.metadata = body.last(static_cast<std::size_t>(metadata));
  return Parsed::kMessage;
}

std::optional<std::string_view> MessageParser::Message::find_metadata(std::string_view key) const {
  constexpr std::size_t kEntryBytes = 8;  // size of the key, encoding of the value, its size
  if (metadata_header.size() < 2) return std::nullopt;
  auto entries = metadata_header.subspan(2);
  auto texts = metadata;
  for (auto left = get<std::uint16_t>(metadata_header); left > 0 && entries.size() >= kEntryBytes; --left) {
    const std::uint64_t key_size = get<std::uint16_t>(entries);
    const std::uint64_t value_size = get<std::uint32_t>(entries.subspan(4));
    if (key_size + value_size > texts.size()) return std::nullopt;
    const auto text = texts.first(static_cast<std::size_t>(key_size + value_size));
    if (get_name(text.first(static_cast<std::size_t>(key_size))) == key)
      return get_name(text.subspan(static_cast<std::size_t>(key_size)));
    entries = entries.subspan(kEntryBytes);
    texts = texts.subspan(text.size());
  }
  return std::nullopt;
}

}  // namespace brachy::net::igtl
