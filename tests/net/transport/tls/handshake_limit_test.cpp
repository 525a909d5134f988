#include "net/transport/tls/handshake_limit.h"

#include <gtest/gtest.h>

#include "tests/net/transport/tls/tls_fixture.h"

namespace brachy::net::test {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// How many of those that come each millisecond begin within ten seconds where each takes `cost_ns`.
int begun_in_ten_seconds(std::int64_t cost_ns) {
  HandshakeLimit limit;
  for (std::int64_t ms = 1; ms <= 10'000; ++ms)
    if (limit.may_begin(ms * kMs)) limit.spent(cost_ns);
  return static_cast<int>(limit.begun());
}

TEST(HandshakeLimit, LeavesTheThreadItsTimeWhateverAKeyCosts) {
  EXPECT_NEAR(begun_in_ten_seconds(0), 1200, 5) << "100 a second and a burst of 200";
  EXPECT_NEAR(begun_in_ten_seconds(300'000), 800, 5);
  EXPECT_NEAR(begun_in_ten_seconds(3'500'000), 69, 2) << "RSA of 4,096 bits: 0.6 % of the milliseconds";
}

TEST(HandshakeLimit, ABurstPassesAndALongPauseAddsNoMore) {
  HandshakeLimit limit;
  const auto burst = [&](std::int64_t now_ns) {
    int begun = 0;
    for (; limit.may_begin(now_ns); ++begun) limit.spent(kMs);
    return begun;
  };
  EXPECT_EQ(burst(kMs), 40);
  EXPECT_EQ(burst(kMs), 0);
  EXPECT_EQ(burst(1'000'000 * kMs), 40);
}

std::vector<std::byte> client_hello(std::size_t record, std::size_t message, std::size_t sent) {
  std::vector<std::byte> bytes(sent);
  const std::size_t head[] = {0x16, 3, 1, record >> 8, record & 0xFF, 1, 0, message >> 8, message & 0xFF};
  for (std::size_t i = 0; i < std::min<std::size_t>(sent, 9); ++i) bytes[i] = static_cast<std::byte>(head[i]);
  return bytes;
}

TEST(ClientHello, BeginsAHandshakeOnlyOnceItIsWhole) {
  const auto find = [](const std::vector<std::byte>& bytes) { return find_client_hello(bytes, 8192); };
  for (std::size_t sent = 0; sent < 205; ++sent)
    EXPECT_EQ(find(client_hello(200, 196, sent)), ClientHello::kIncomplete) << sent;
  EXPECT_EQ(find(client_hello(200, 196, 205)), ClientHello::kComplete);
  EXPECT_EQ(find(client_hello(200, 197, 205)), ClientHello::kBad) << "in two records";
  EXPECT_EQ(find(client_hello(9000, 8996, 20)), ClientHello::kBad) << "too long";
  auto other = client_hello(200, 196, 205);
  other[5] = std::byte{2};
  EXPECT_EQ(find(other), ClientHello::kBad);
  other[0] = std::byte{0x17};
  EXPECT_EQ(find(other), ClientHello::kBad);
}

struct HandshakeFlood : TlsFixture {};

TEST_F(HandshakeFlood, OfBareClientHellosFewAreAnsweredAndARightfulClientGetsIn) {
  ServerOptions options;
  options.tls = server_context();
  start(options);
  const auto device = join_over_tls(client_context());
  std::vector<std::unique_ptr<RawPeer>> bare;
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 1000; ++i) {
    bare.push_back(std::make_unique<RawPeer>(io, server->port(), 0, client_context()));
    bare.back()->hello();  // begins the handshake, of which no more is read
    io.poll();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  EXPECT_LE(server->handshakes()->begun(), 202 + static_cast<std::uint64_t>(100 * seconds));
  bare.clear();
  const auto rightful = join_over_tls(client_context());
  EXPECT_TRUE(until([&] { return rightful->welcomes == 1; }));
  EXPECT_TRUE(device->closed.empty());
}

}  // namespace
}  // namespace brachy::net::test
