#include "net/igtl/content/commands.h"

#include <gtest/gtest.h>

#include <vector>

#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/codec.h"
#include "net/igtl/codec/text_codec.h"

namespace brachy::net::igtl {
namespace {

struct IgtlCommands : ::testing::Test {
  std::string execute(std::string_view text) {
    RequestServer server;
    server.needles = 2;
    server.is_own_device = [this](std::uint16_t needle) { return needle == own_device; };
    server.broadcast_state = [] {};
    RequestHandlers& handlers = server.handlers;
    handlers.set<ControlMessage>([this](const ControlMessage& message, const Sender& sender) {
      controls.push_back(message);
      clients.push_back(sender.name);
      return refusal;
    });
    handlers.set<ArmMessage>([this](const ArmMessage& arm, const Sender&) { arms.push_back(arm.needle); });
    handlers.set<DropMessage>(
        [this](const DropMessage& drop, const Sender&) { drops.emplace_back(drop.needle, drop.pressed); });
    last = execute_command(
        text,
        {server, rates, ++now_ns * 1'000'000'000, {"slicer", Role::kOperator}, [this](std::uint16_t needle) {
           return needle == held;
         }});
    return last ? last->text : "";
  }

  std::vector<ControlMessage> controls;
  std::vector<std::string> clients;
  std::vector<std::uint16_t> arms;
  std::vector<std::pair<std::uint16_t, bool>> drops;
  std::string refusal;
  Refusal last;
  RateLimits rates;
  std::int64_t now_ns = 0;
  int own_device = 0, held = -1;
};

TEST_F(IgtlCommands, AreTheOperatorsOfTheNativeProtocol) {
  for (const char* text : {"reset", "play", " play  loop ", "stop", "model psi31", "model psi32 15.5"})
    EXPECT_EQ(execute(text), "") << text;
  ASSERT_EQ(controls.size(), 6u);
  EXPECT_EQ(controls[0].action, ControlAction::kReset);
  EXPECT_EQ(controls[1].action, ControlAction::kPlay);
  EXPECT_FALSE(controls[1].loop);
  EXPECT_TRUE(controls[2].loop);
  EXPECT_EQ(controls[3].action, ControlAction::kStop);
  EXPECT_EQ(controls[4].kernel, "psi31");
  EXPECT_EQ(controls[5].support_radius_mm, 15.5);
  EXPECT_EQ(clients[0], "slicer");
}

TEST_F(IgtlCommands, ArmAndDropNameANeedle) {
  EXPECT_EQ(execute("arm 1"), "");
  EXPECT_EQ(execute("drop"), "");
  EXPECT_EQ(arms, std::vector<std::uint16_t>{1});
  EXPECT_EQ(drops, (std::vector<std::pair<std::uint16_t, bool>>{{0, true}, {0, false}}));
  for (const char* text : {"arm 2", "drop 2"}) {
    EXPECT_EQ(execute(text), "there is no needle 2: needles are 0 to 1");
    EXPECT_EQ(last->code, ErrorCode::kNoNeedle);
  }
  EXPECT_EQ(arms.size(), 1u);
}

// However many come at once, none that is refused is called done.
TEST_F(IgtlCommands, BeyondTheirRateEachIsRefused) {
  for (int n = 0; n < 50; ++n) {
    now_ns = 0;  // all in one moment
    EXPECT_EQ(execute("arm 0"), n < 10 ? "" : "more than 10 ARMs a second") << n;
  }
  EXPECT_EQ(arms.size(), 10u);
}

// The native protocol refuses an operator the same: another's device holds the needle.
TEST_F(IgtlCommands, DropNothingOfAnothersDevice) {
  EXPECT_NE(execute("drop 1").find("only the device of needle 1 drops its seeds"), std::string::npos);
  own_device = -1;
  EXPECT_NE(execute("drop").find("only the device of needle 0 drops its seeds"), std::string::npos);
  EXPECT_TRUE(drops.empty());
  held = 1;
  EXPECT_EQ(execute("drop 1"), "") << "it is the device";
  EXPECT_EQ(drops, (std::vector<std::pair<std::uint16_t, bool>>{{1, true}, {1, false}}));
}

TEST_F(IgtlCommands, WhatIsNoneDoesNothingAndIsToldWhatThereIs) {
  for (const char* text : {"", " ", "dance", "reset now", "arm x", "arm 65536", "arm -1", "drop 0 1",
                           "play twice", "model", "model psi31 wide", "model a b c"})
    EXPECT_NE(execute(text).find("commands are reset, play"), std::string::npos) << text;
  EXPECT_TRUE(controls.empty() && arms.empty() && drops.empty());
}

TEST_F(IgtlCommands, ARefusalIsPassedOn) {
  refusal = "a session is being recorded";
  EXPECT_EQ(execute("reset"), refusal);
  EXPECT_EQ(last->code, ErrorCode::kControlRefused);
}

Bytes command(std::uint32_t id, std::string_view name, std::string_view content, std::uint32_t length) {
  Bytes bytes;
  put(bytes, id);
  put_name(bytes, name, 128);
  put(bytes, std::uint16_t{3});
  put(bytes, length);
  put_name(bytes, content, content.size());
  return bytes;
}

TEST(IgtlTextCodec, ReadsACommandAsUpstreamsHeaderHasIt) {
  const auto read = decode_command(command(7, "RequestChannelIds", "<Command/>", 10));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->id, 7u);
  EXPECT_EQ(read->name, "RequestChannelIds");
  EXPECT_EQ(read->content, "<Command/>");
}

TEST(IgtlTextCodec, RefusesSizesThatDoNotFit) {
  EXPECT_FALSE(decode_command({}));
  EXPECT_FALSE(decode_command(command(7, "a", "bc", 3)));
  EXPECT_FALSE(decode_command(command(7, "a", "bc", 0xFFFFFFFF)));
  const Bytes whole = command(7, "a", "", 0);
  EXPECT_TRUE(decode_command(whole));
  EXPECT_FALSE(decode_command(std::span(whole).first(whole.size() - 1)));
  Bytes text;
  put(text, std::uint16_t{3});
  put(text, std::uint16_t{5});
  put_name(text, "reset", 5);
  EXPECT_EQ(decode_string(text), "reset");
  text[3] = std::byte{6};
  EXPECT_FALSE(decode_string(text));
  EXPECT_FALSE(decode_string(std::span(text).first(3)));
}

TEST(IgtlTextCodec, TheAnswerHasTheCommandsNumberTheErrorInItsNamesPlaceAndAllOfItInItsContent) {
  const Bytes done = encode_command_answer({2, "Slicer", 0}, 9, 0, "");
  EXPECT_EQ(decode_header(done).type, "RTS_COMMAND");
  const auto content_of = [](const Bytes& message) {
    const auto body = std::span(message).subspan(kHeaderSize + kExtendedHeaderSize);
    return decode_command(body.first(body.size() - 2));
  };
  EXPECT_EQ(content_of(done)->id, 9u);
  EXPECT_EQ(content_of(done)->name, "");
  EXPECT_EQ(content_of(done)->content, "<Command><Result success=\"true\"/></Command>");
  const Bytes refused = encode_command_answer({2, "Slicer", 0}, 10, 13, std::string(200, 'x'));
  EXPECT_EQ(content_of(refused)->name, std::string(127, 'x'));
  EXPECT_NE(content_of(refused)->content.find("false"), std::string::npos);
  const Bytes quoted = encode_command_answer({2, "Slicer", 0}, 11, 13, "no kernel \"<&\"");
  EXPECT_EQ(
      content_of(quoted)->content,
      "<Command><Result success=\"false\"><Parameter Name=\"Code\" Value=\"13\"/><Parameter Name=\"Reason\" "
      "Value=\"no kernel &quot;&lt;&amp;&quot;\"/></Result></Command>");
}

}  // namespace
}  // namespace brachy::net::igtl
