#include "net/wire/message_parser.h"

#include "net/wire/first_byte.h"

namespace brachy::net {

void MessageParser::feed(std::span<const std::byte> bytes) {
  if (bad_.is_bad()) return;
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(consumed_));
  consumed_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

DecodeResult MessageParser::read_header(std::span<const std::byte> bytes, Header& header) const {
  const DecodeResult result = decode_header(bytes, max_body_bytes_, header);
  const bool is_too_long = result.is_bad() && result.code == ErrorCode::kTooLarge;
  return is_too_long && header.type == longer_type_ ? decode_header(bytes, longer_bytes_, header) : result;
}

DecodeResult MessageParser::next(Message& message) {
  if (bad_.is_bad()) return bad_;
  const auto rest = std::span<const std::byte>(buffer_).subspan(consumed_);
  if (rest.empty()) return DecodeResult::need_more();
  DecodeResult result = read_header(rest, message.header);
  if (result.is_good() && message.header.sequence != last_sequence_ + 1) {
    result = DecodeResult::bad("a message is missing: the sequence number is not the last one plus 1");
  }
  if (last_sequence_ == 0 && rest[0] == std::byte{kFirstByteOfTls})
    result = DecodeResult::bad("no TLS is spoken on this port");
  if (result.is_bad()) bad_ = result;
  if (!result.is_good()) return result;
  if (rest.size() < kHeaderSize + message.header.length) return DecodeResult::need_more();
  message.body = rest.subspan(kHeaderSize, message.header.length);
  consumed_ += kHeaderSize + message.header.length;
  last_sequence_ = message.header.sequence;
  return result;
}

}  // namespace brachy::net
