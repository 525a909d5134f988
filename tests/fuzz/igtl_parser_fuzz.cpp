// A stream of OpenIGTLink messages: parsed whole and in pieces it gives the same messages, and transforms round-trip.
#include "net/igtl/codec/message_parser.h"

#include "net/igtl/codec/codec.h"
#include "net/igtl/content/needle_name.h"
#include "net/wire/messages.h"
#include "tests/fuzz/igtl_script.h"

namespace brachy::fuzz {
namespace {

using namespace net::igtl;

/// The result of a stream, as text.
class Cut {
 public:
  void feed(std::span<const std::byte> bytes) {
    parser_.feed(bytes);
    MessageParser::Message message;
    while (!is_lost_) {
      const Parsed parsed = parser_.next(message);
      if (parsed == Parsed::kNeedMore) return;
      is_lost_ = parsed == Parsed::kLost;
      add(static_cast<std::uint64_t>(parsed), message.header.type + "," + message.header.device);
      if (parsed == Parsed::kMessage) decode(message);
    }
  }
  const std::string& log() const { return log_; }

 private:
  void add(std::uint64_t number, std::string_view text) {
    log_.append(std::to_string(number)).append(",").append(text).append("\n");
  }

  void decode(const MessageParser::Message& message) {
    add(needle_of(message.header.device).value_or(net::kAnyNeedle), text_of(message.content));
    add(0, message.find_metadata("TransformStatus").value_or("none"));
    if (const auto asked = decode_start_tracking(message.content)) add(asked->resolution_ms, "ms");
    const auto X = decode_transform(message.content);
    if (!X || !X->R.allFinite() || !X->p.allFinite()) return;
    const net::Bytes again = encode_transform({}, *X);
    EXPECT_EQ(text_of(std::span(again).subspan(kHeaderSize)), text_of(message.content));
  }

  MessageParser parser_;
  std::string log_;
  bool is_lost_ = false;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  net::Bytes stream;
  while (!script.is_over()) {
    const net::Bytes message = next_igtl_message(script);
    stream.insert(stream.end(), message.begin(), message.end());
  }
  Cut whole, in_pieces;
  whole.feed(stream);
  feed_in_pieces(stream, [&](std::span<const std::byte> piece) { in_pieces.feed(piece); });
  EXPECT_EQ(whole.log(), in_pieces.log());
  return 0;
}

}  // namespace brachy::fuzz
