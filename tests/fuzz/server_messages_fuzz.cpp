// A client's handling of a server's messages: a script of messages, each with a matching header and topology hash. A
// refused message changes nothing, and a stream in pieces gives the same result.
#include "net/client/server_messages.h"

#include <tuple>

#include "net/wire/message_parser.h"
#include "tests/fuzz/message_script.h"

namespace brachy::fuzz {
namespace {

using namespace net;

/// A client, and the messages it got.
class Client {
 public:
  void feed(std::span<const std::byte> bytes) {
    parser_.feed(bytes);
    MessageParser::Message message;
    DecodeResult result;
    while ((result = parser_.next(message)).is_good()) take(message);
    if (!result.is_bad()) return;
    EXPECT_FALSE(result.reason.empty());
    end_ = result.reason;
  }
  bool operator==(const Client& other) const {
    return end_ == other.end_ && refusals_ == other.refusals_ && shape() == other.shape();
  }

 private:
  void take(const MessageParser::Message& message) {
    const auto before = shape();
    const std::string_view why = messages_.take(message.header, message.body);
    refusals_.emplace_back(why);
    if (why.empty()) return;
    EXPECT_TRUE(before == shape()) << "refused, but taken: " << why;
  }

  /// Bits, so that NaN is itself.
  std::tuple<Bytes, std::vector<Seed>, std::uint64_t, bool> shape() const {
    const FrameAssembler& mesh = messages_.mesh();
    const auto bytes = std::as_bytes(std::span(mesh.positions()));
    return {Bytes(bytes.begin(), bytes.end()), mesh.seeds(), mesh.tick(), mesh.has_frame()};
  }

  MessageParser parser_{1 << 20};
  ServerMessages messages_{{}};
  std::vector<std::string> refusals_;
  std::string end_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  Bytes stream;
  for (ServerScript server(script); !script.is_over();) {
    const Bytes message = server.next();
    stream.insert(stream.end(), message.begin(), message.end());
  }
  Client whole, in_pieces;
  whole.feed(stream);
  feed_in_pieces(stream, [&](std::span<const std::byte> piece) { in_pieces.feed(piece); });
  EXPECT_TRUE(whole == in_pieces);
  return 0;
}

}  // namespace brachy::fuzz
