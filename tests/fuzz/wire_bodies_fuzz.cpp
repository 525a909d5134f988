// A body of the native protocol: its type, a byte, and the body. What is decoded must survive its own encoding.
#include "tests/fuzz/fuzzing.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace net;
  Script script(data, size);
  const auto type = static_cast<MessageType>(script.u8());
  const auto body = script.rest();
  Bytes once, twice;
  std::size_t held = 0;
  const DecodeResult result = net::test::decode_any(type, body, once, held);
  // An empty text is two bytes, and here a std::string, whose capacity is counted once more.
  EXPECT_LE(held, 24 * body.size() + 256);
  if (result.is_good()) {
    EXPECT_TRUE(net::test::decode_any(type, once, twice, held).is_good());
    EXPECT_EQ(twice, once);
  } else {
    EXPECT_TRUE(result.is_bad());
    EXPECT_FALSE(result.reason.empty());
  }
  return 0;
}

}  // namespace brachy::fuzz
