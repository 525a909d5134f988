#include "net/access/gate.h"

#include <gtest/gtest.h>

namespace brachy::net::test {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000, kNow = 1000 * kSecond;
using Slots = std::vector<std::shared_ptr<const ConnectionSlot>>;

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

Slots entered(Gate& gate, const std::string& address, int count) {
  Slots slots;
  for (int i = 0; i < count; ++i) slots.push_back(gate.acquire_slot(address, kNow));
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
  EXPECT_TRUE(gate.acquire_slot("::1", kNow)->refusal());
  slots.pop_back();
  const auto again = gate.acquire_slot("::1", kNow);
  EXPECT_FALSE(again->refusal());
  EXPECT_TRUE(gate.acquire_slot("::1", kNow)->refusal());
}

TEST(Gate, OnlySoManyAreToldThatThereIsNoPlace) {
  Gate gate(1, 1, {});
  Slots slots = entered(gate, "10.0.0.1", 1 + static_cast<int>(Gate::kMaxPendingRefusals));
  EXPECT_TRUE(slots.back()->refusal());
  EXPECT_EQ(gate.acquire_slot("10.0.0.1", kNow), nullptr);
  EXPECT_EQ(gate.acquire_slot("10.0.0.2", kNow), nullptr);
  slots.pop_back();
  EXPECT_TRUE(gate.acquire_slot("10.0.0.2", kNow)->refusal());
}

TEST(Gate, AsksForATokenOnlyWhereThereIsOne) {
  Gate open(1, 1, {}), closed(1, 1, three_tokens());
  EXPECT_FALSE(open.refusal("a", std::nullopt, Role::kOperator, kNow));
  EXPECT_FALSE(open.refusal("a", token_of(9), Role::kOperator, kNow));
  EXPECT_FALSE(closed.refusal("a", token_of(3), Role::kViewer, kNow));
  const auto none = closed.refusal("a", std::nullopt, Role::kViewer, kNow);
  const auto other = closed.refusal("a", token_of(3), Role::kOperator, kNow);
  const auto wrong = closed.refusal("a", token_of(9), Role::kViewer, kNow);
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

TEST(Gate, WrongTokensShutTheirAddressOutForAMinute) {
  Gate gate(9, 9, three_tokens());
  const auto is_out = [&](const std::string& address, std::int64_t now_ns) {
    const auto slot = gate.acquire_slot(address, now_ns);
    return slot->refusal() && slot->refusal()->code == ErrorCode::kUnauthorised;
  };
  const auto guess = [&](std::int64_t now_ns) { gate.refusal("a", token_of(9), Role::kViewer, now_ns); };
  for (std::size_t i = 0; i < Gate::kMaxWrongTokens; ++i) {
    EXPECT_FALSE(is_out("a", kNow));
    guess(kNow + static_cast<std::int64_t>(i) * kSecond);
  }
  EXPECT_TRUE(is_out("a", kNow + 10 * kSecond));
  EXPECT_FALSE(is_out("b", kNow + 10 * kSecond));
  EXPECT_TRUE(is_out("a", kNow + 60 * kSecond - 1));
  EXPECT_FALSE(is_out("a", kNow + 60 * kSecond));
  guess(kNow + 60 * kSecond);  // now the last ten began a second later
  EXPECT_TRUE(is_out("a", kNow + 61 * kSecond - 1));
  EXPECT_FALSE(is_out("a", kNow + 61 * kSecond));
}

TEST(Gate, NeitherNoTokenNorOneForAnotherRoleShutsAnybodyOut) {
  Gate gate(9, 9, three_tokens());
  for (int i = 0; i < 100; ++i) {
    gate.refusal("a", std::nullopt, Role::kViewer, kNow);
    gate.refusal("a", token_of(3), Role::kOperator, kNow);
  }
  EXPECT_FALSE(gate.acquire_slot("a", kNow)->refusal());
}

TEST(Gate, RemembersFewAddresses) {
  Gate gate(9, 9, three_tokens());
  for (int i = 0; i < 5000; ++i) gate.refusal(std::to_string(i), token_of(9), Role::kViewer, kNow + i);
  EXPECT_EQ(gate.wrong_tokens(), 5000u);
  EXPECT_LE(gate.remembered_addresses(), 1024u);
}

TEST(Gate, PlacesMayOutliveIt) {
  auto gate = std::make_unique<Gate>(2, 2, TokenGrants());
  const auto slot = gate->acquire_slot("a", kNow);
  gate.reset();
  EXPECT_EQ(slot->address(), "a");
}

}  // namespace
}  // namespace brachy::net::test
