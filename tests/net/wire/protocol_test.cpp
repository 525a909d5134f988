// The golden bytes of net/PROTOCOL.md against the codec. scripts/ci/wire_document.py packs them from the fields and
// examples of net/protocol.json, without the codec.
#include <gtest/gtest.h>

#include <string>

#include "tests/net/wire/golden_blocks.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

template <class Message>
void expect_golden(const std::string& name, const Message& message, std::uint64_t sequence,
                   std::int64_t stamp_ns) {
  static const auto blocks = golden_blocks();
  ASSERT_TRUE(blocks.contains(name)) << name;
  const Bytes& golden = blocks.at(name);
  Bytes encoded;
  encode(message, sequence, stamp_ns, encoded);
  EXPECT_EQ(encoded, golden) << name;

  Header header;
  ASSERT_TRUE(decode_header(golden, 1 << 20, header).is_good()) << name;
  EXPECT_EQ(header.type, Message::kType);
  EXPECT_EQ(header.sequence, sequence);
  EXPECT_EQ(header.stamp_ns, stamp_ns);
  Message decoded;
  const DecodeResult result = decode_body(std::span<const std::byte>(golden).subspan(kHeaderSize), decoded);
  ASSERT_TRUE(result.is_good()) << name << ": " << result.reason;
  encoded.clear();
  encode(decoded, sequence, stamp_ns, encoded);
  EXPECT_EQ(encoded, golden) << name;
}

TEST(Protocol, GoldenBytesOfTheDocumentAreWhatTheCodecWritesAndReads) {
  expect_golden("HELLO", sample_hello(), 1, 1'000'000'001);
  expect_golden("HELLO_TOKEN", sample_hello_with_token(), 1, 1'000'000'002);
  expect_golden("HELLO_IMAGES", sample_hello_with_images(), 1, 1'000'000'003);
  expect_golden("WELCOME", sample_welcome(), 1, 2'000'000'001);
  expect_golden("TOPOLOGY", sample_topology(), 2, 2'000'000'002);
  expect_golden("FRAME", sample_frame(), 3, 2'000'000'003);
  expect_golden("POSE", sample_pose(), 17, 1'000'000'500);
  expect_golden("STATE", sample_state(), 4, 2'000'000'004);
  expect_golden("EVENT", sample_event(), 5, 2'000'000'005);
  expect_golden("ERROR", sample_error(), 6, 2'000'000'006);
  expect_golden("PING", sample_ping(), 18, 1'000'000'600);
  expect_golden("FORCE", sample_force(), 7, 2'000'000'008);
  expect_golden("LOCAL_MODEL", sample_local_model(), 8, 2'000'000'009);
  expect_golden("ARM", sample_arm(), 19, 1'000'000'700);
  expect_golden("DROP", sample_drop(), 20, 1'000'000'800);
  expect_golden("DOSE", sample_dose(), 9, 2'000'000'010);
  expect_golden("DOSE_PLANNED", sample_dose_with_planned(), 12, 2'000'000'013);
  expect_golden("CONTROL", sample_control(), 21, 1'000'000'900);
  expect_golden("LOAD", sample_load(), 22, 1'000'001'256);
  expect_golden("PLAN", sample_plan(), 13, 2'000'000'014);
  expect_golden("SCENE", sample_scene(), 10, 2'000'000'011);
  expect_golden("IMAGE", sample_image(), 11, 2'000'000'012);
  expect_golden("SCANNER", sample_scanner(), 22, 1'000'001'000);
  expect_golden("CONTOUR", sample_contour(), 23, 1'000'001'512);
  expect_golden("EXERCISE", sample_exercise(), 24, 1'000'001'768);
}

}  // namespace
}  // namespace brachy::net::test
