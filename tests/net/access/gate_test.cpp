#include "net/access/gate.h"

#include <gtest/gtest.h>

namespace brachy::net::test {
namespace {

using Slots = std::vector<std::shared_ptr<ConnectionSlot>>;

Token token_of(int first, int last = 0) {
  Token token{};
  token.front() = static_cast<std::byte>(first);
  token.back() = static_cast<std::byte>(last);
  return token;
}

TokenGrants three_tokens() {
  TokenGrants tokens;
  tokens.add(token_of(1), {Role::kViewer, Role::kDevice, Role::kOperator});
  tokens.add(token_of(2), {Role::kViewer, Role::kDevice});
  tokens.add(token_of(3), {Role::kViewer});
  return tokens;
}

/// `count` connections from `address` that say HELLO at once. Those that are not refused become clients.
Slots entered(Gate& gate, const std::string& address, int count) {
  Slots slots;
  for (int i = 0; i < count; ++i) {
    slots.push_back(gate.acquire_slot(address));
    if (slots.back() && !gate.busy(*slots.back())) gate.promote(*slots.back());
  }
  return slots;
}

TEST(TokenGrants, EachTokenGivesItsRoles) {
  using Answer = TokenGrants::Answer;
  const TokenGrants tokens = three_tokens();
  const auto answers = [&](const Token& token) {
    return std::vector{tokens.ask(token, Role::kViewer), tokens.ask(token, Role::kDevice),
                       tokens.ask(token, Role::kOperator)};
  };
  constexpr auto kYes = Answer::kGranted, kOther = Answer::kOtherRole, kNo = Answer::kUnknown;
  EXPECT_EQ(answers(token_of(1)), (std::vector{kYes, kYes, kYes}));
  EXPECT_EQ(answers(token_of(2)), (std::vector{kYes, kYes, kOther}));
  EXPECT_EQ(answers(token_of(3)), (std::vector{kYes, kOther, kOther}));
  EXPECT_EQ(answers(token_of(4)), (std::vector{kNo, kNo, kNo}));
  EXPECT_EQ(answers(token_of(1, 1)), (std::vector{kNo, kNo, kNo})) << "to its last byte";
}

TEST(TokenGrants, OneTokenInTwoFilesGivesTheRolesOfBoth) {
  TokenGrants tokens;
  tokens.add(token_of(1), {Role::kViewer});
  tokens.add(token_of(1), {Role::kDevice});
  EXPECT_EQ(tokens.ask(token_of(1), Role::kViewer), TokenGrants::Answer::kGranted);
  EXPECT_EQ(tokens.ask(token_of(1), Role::kDevice), TokenGrants::Answer::kGranted);
  EXPECT_EQ(tokens.ask(token_of(1), Role::kOperator), TokenGrants::Answer::kOtherRole);
}

TEST(Gate, PlacesAreLimitedInAllAndForAnAddress) {
  Gate gate(5, 3, {});
  const Slots first = entered(gate, "10.0.0.1", 4);
  EXPECT_FALSE(first[2]->refusal());
  ASSERT_TRUE(first[3]->refusal());
  EXPECT_EQ(first[3]->refusal()->code, ErrorCode::kBusy);
  EXPECT_NE(first[3]->refusal()->text.find("10.0.0.1"), std::string::npos);
  const Slots second = entered(gate, "10.0.0.2", 3);
  EXPECT_FALSE(second[1]->refusal());
  ASSERT_TRUE(second[2]->refusal());
  EXPECT_EQ(second[2]->refusal()->text, "all 5 client slots are in use");
}

TEST(Gate, APlaceIsFreeOnceItsConnectionEnds) {
  Gate gate(2, 2, {});
  Slots slots = entered(gate, "::1", 2);
  EXPECT_TRUE(gate.acquire_slot("::1")->refusal());
  slots.pop_back();
  const auto again = gate.acquire_slot("::1");
  EXPECT_FALSE(again->refusal());
  gate.promote(*again);
  EXPECT_TRUE(gate.acquire_slot("::1")->refusal());
}

TEST(Gate, OnlySoManyAreToldThatThereIsNoPlace) {
  Gate gate(1, 1, {});
  Slots slots = entered(gate, "10.0.0.1", 1 + static_cast<int>(Gate::kMaxPendingRefusals));
  EXPECT_TRUE(slots.back()->refusal());
  EXPECT_EQ(gate.acquire_slot("10.0.0.1"), nullptr);
  EXPECT_EQ(gate.acquire_slot("10.0.0.2"), nullptr);
  slots.pop_back();
  EXPECT_TRUE(gate.acquire_slot("10.0.0.2")->refusal());
}

TEST(Gate, AsksForATokenOnlyWhereThereIsOne) {
  Gate open(1, 1, {}), closed(1, 1, three_tokens());
  EXPECT_FALSE(open.refusal(std::nullopt, Role::kOperator));
  EXPECT_FALSE(open.refusal(token_of(9), Role::kOperator));
  EXPECT_FALSE(closed.refusal(token_of(3), Role::kViewer));
  const auto none = closed.refusal(std::nullopt, Role::kViewer);
  const auto other = closed.refusal(token_of(3), Role::kOperator);
  const auto wrong = closed.refusal(token_of(9), Role::kViewer);
  for (const auto& refusal : {none, other, wrong}) {
    ASSERT_TRUE(refusal);
    EXPECT_EQ(refusal->code, ErrorCode::kUnauthorised);
    EXPECT_TRUE(refusal->fatal);
  }
  EXPECT_NE(none->text.find("--token-file"), std::string::npos);
  EXPECT_NE(other->text.find("role"), std::string::npos);
  EXPECT_NE(wrong->text.find("not known to this daemon"), std::string::npos);
  EXPECT_EQ(closed.wrong_tokens(), 1u);
}

TEST(Gate, AThousandWrongTokensShutNobodyOut) {
  Gate gate(9, 9, three_tokens());
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(gate.refusal(token_of(9), Role::kViewer));
  EXPECT_EQ(gate.wrong_tokens(), 1000u);
  EXPECT_FALSE(gate.acquire_slot("a")->refusal());
  EXPECT_FALSE(gate.refusal(token_of(1), Role::kOperator));
}

TEST(Gate, TheLoopbackAndANetworkOf64BitsAreOneAddress) {
  for (const char* address : {"127.0.0.1", "127.0.0.3", "127.255.255.254", "::1"})
    EXPECT_EQ(origin_of(address), origin_of("127.0.0.1")) << address;
  EXPECT_EQ(origin_of("2001:db8:1:2::3"), origin_of("2001:db8:1:2:ffff::1"));
  EXPECT_NE(origin_of("2001:db8:1:2::3"), origin_of("2001:db8:1:3::3"));
  EXPECT_EQ(origin_of("fe80::1%eth0"), origin_of("fe80::2%eth0"));
  EXPECT_EQ(origin_of("128.0.0.1"), "128.0.0.1");
  EXPECT_EQ(origin_of("unknown"), "unknown");
  Gate gate(9, 3, {});
  Slots slots = entered(gate, "127.0.0.1", 1), more = entered(gate, "127.0.0.2", 1),
        ipv6 = entered(gate, "::1", 2);
  EXPECT_FALSE(ipv6[0]->refusal());
  EXPECT_TRUE(ipv6[1]->refusal());
}

TEST(Gate, SilentConnectionsTakeNoClientsPlaceAndTheOldestIsShed) {
  Gate gate(2, 2, {});
  Slots silent;
  std::vector<int> shed;
  for (int i = 0; i < 300; ++i) {
    silent.push_back(gate.acquire_slot("127.0.0." + std::to_string(1 + i % 3)));
    ASSERT_TRUE(silent.back());
    EXPECT_FALSE(silent.back()->refusal());
    silent.back()->on_shed([&, i] {
      shed.push_back(i);
      silent[static_cast<std::size_t>(i)].reset();
    });
  }
  EXPECT_EQ(gate.shed(), 300 - Gate::kMaxWaiting);
  EXPECT_EQ(shed.front(), 0);
  EXPECT_EQ(shed.back(), static_cast<int>(299 - Gate::kMaxWaiting));
  const auto rightful = gate.acquire_slot("127.0.0.9");
  EXPECT_FALSE(gate.busy(*rightful));
  gate.promote(*rightful);
  EXPECT_FALSE(rightful->is_waiting());
}

TEST(Gate, AFloodFromOneAddressShedsNoneOfAnother) {
  Gate gate(9, 9, {});
  bool is_shed = false;
  const auto slow = gate.acquire_slot("192.0.2.7");
  slow->on_shed([&] { is_shed = true; });
  Slots flood;
  for (int i = 0; i < 1000; ++i) flood.push_back(gate.acquire_slot("198.51.100.1"));
  EXPECT_FALSE(is_shed);
  EXPECT_TRUE(slow->is_waiting());
}

TEST(Gate, ConnectionsWithoutHelloTakeAQuarterOfThePlacesAtMost) {
  Gate gate(8, 8, {});
  Slots slots;
  for (int i = 0; i < 3; ++i) slots.push_back(gate.acquire_slot("a", Gate::Entry::kImmediate));
  EXPECT_FALSE(slots[1]->refusal());
  EXPECT_TRUE(slots[2]->refusal());
  slots.erase(slots.begin());
  EXPECT_FALSE(gate.acquire_slot("a", Gate::Entry::kImmediate)->refusal());
}

TEST(Gate, RequestsAreTakenWhileNoPlaceIsFree) {
  Gate gate(1, 1, {});
  const Slots client = entered(gate, "a", 1);
  Slots requests;
  for (int i = 0; i < 500; ++i) {
    requests.push_back(gate.acquire_slot("a", Gate::Entry::kRequest));
    ASSERT_TRUE(requests.back());
    EXPECT_FALSE(requests.back()->refusal());
    EXPECT_TRUE(gate.busy(*requests.back()));
  }
}

TEST(Gate, PlacesMayOutliveIt) {
  auto gate = std::make_unique<Gate>(2, 2, TokenGrants());
  const auto slot = gate->acquire_slot("a");
  gate.reset();
  EXPECT_EQ(slot->address(), "a");
}

}  // namespace
}  // namespace brachy::net::test
