// Access control over real sockets: tokens, roles, and the slots that all listeners share.
#include <algorithm>
#include <boost/asio/ssl/context.hpp>

#include "net/access/token_file.h"
#include "net/igtl/igtl_server.h"
#include "tests/net/http/http_testing.h"
#include "tests/net/igtl/igtl_peer.h"
#include "tests/net/raw_peer.h"

namespace brachy::net::test {
namespace {

/// Enough for the rule which addresses are bound.
TlsContext some_tls() {
  return std::make_shared<boost::asio::ssl::context>(boost::asio::ssl::context::tls_server);
}

using igtl::IgtlOptions;
using igtl::IgtlServer;
using igtl::test::IgtlPeer;

Token token_of(char c) {
  Token token;
  token.fill(static_cast<std::byte>(c));
  return token;
}

struct AccessTest : HttpFixture {
  static ServerOptions with_tokens() {
    ServerOptions options;
    options.tokens.add(token_of('o'), {Role::kViewer, Role::kDevice, Role::kOperator});
    options.tokens.add(token_of('d'), {Role::kViewer, Role::kDevice});
    options.tokens.add(token_of('v'), {Role::kViewer});
    return options;
  }

  void start_igtl() {
    IgtlOptions options;
    options.without_token = true;
    igtl.emplace(io, options, *server, tissue, [this](const std::string& line) { log.push_back(line); });
  }

  /// Waits until the peer was welcomed or refused. ErrorCode 0: it was welcomed.
  template <class AnyPeer>
  ErrorCode answer_to(AnyPeer& peer) {
    EXPECT_TRUE(until([&] {
      peer.take();
      return !peer.types.empty() || peer.is_ended();
    }));
    return peer.fatal();
  }
  ErrorCode join_raw(Role role, std::optional<Token> token, const std::string& from = "127.0.0.1") {
    RawPeer peer(io, server->port(), 0, {}, from);
    peer.hello(role, kSubscribeNoMesh, token);
    return answer_to(peer);
  }

  std::optional<IgtlServer> igtl;
};

TEST_F(AccessTest, ATokenLetsItsRolesInAndNoOther) {
  start(with_tokens());
  constexpr auto kIn = ErrorCode{}, kOut = ErrorCode::kUnauthorised;
  const auto roles = [&](std::optional<Token> token) {
    return std::vector{join_raw(Role::kViewer, token), join_raw(Role::kDevice, token),
                       join_raw(Role::kOperator, token)};
  };
  EXPECT_EQ(roles(token_of('o')), (std::vector{kIn, kIn, kIn}));
  ASSERT_TRUE(until([&] { return server->lease_holder(0).empty(); }));
  EXPECT_EQ(roles(token_of('d')), (std::vector{kIn, kIn, kOut}));
  EXPECT_EQ(roles(token_of('v')), (std::vector{kIn, kOut, kOut}));
  EXPECT_EQ(roles(token_of('x')), (std::vector{kOut, kOut, kOut}));
  EXPECT_EQ(roles(std::nullopt), (std::vector{kOut, kOut, kOut}));
}

TEST_F(AccessTest, TheClientShowsItsTokenAndIsToldWhatItLacks) {
  start(with_tokens());
  ClientOptions options;
  options.token = token_of('v');
  const auto in = join(options);
  EXPECT_TRUE(until([&] { return in->welcomes == 1; }));
  options.token.reset();
  const auto out = join(options);
  ASSERT_TRUE(until([&] { return !out->closed.empty(); }));
  EXPECT_EQ(out->errors.at(0).code, ErrorCode::kUnauthorised);
  EXPECT_NE(out->closed[0].find("--token-file"), std::string::npos);
  EXPECT_EQ(out->welcomes, 0);
}

TEST_F(AccessTest, PagesNeedATokenToo) {
  start_http(with_tokens());
  EXPECT_EQ(get("/").status, 200) << "the page, which asks for it";
  const auto page = open_page();
  page->hello(Role::kOperator, 0);
  EXPECT_EQ(answer_to(*page), ErrorCode::kUnauthorised);
  EXPECT_TRUE(ends(*page));
  EXPECT_EQ(page->close_code(), 1000);
  const auto known = open_page();
  known->hello(Role::kOperator, 0, token_of('o'));
  EXPECT_EQ(answer_to(*known), ErrorCode{});
}

TEST_F(AccessTest, WithoutTokensNobodyNeedsOne) {
  start();
  EXPECT_EQ(join_raw(Role::kOperator, std::nullopt), ErrorCode{});
  EXPECT_EQ(join_raw(Role::kOperator, token_of('x')), ErrorCode{});
}

TEST_F(AccessTest, WhoGuessesWaitsAndNobodyElseDoes) {
  start_http(with_tokens());
  RawPeer before(io, server->port());
  before.hello(Role::kViewer, kSubscribeNoMesh, token_of('v'));
  EXPECT_EQ(answer_to(before), ErrorCode{});
  std::vector<std::unique_ptr<RawPeer>> guessers;
  for (int i = 0; i < 50; ++i) {
    guessers.push_back(std::make_unique<RawPeer>(io, server->port()));
    guessers.back()->hello(Role::kViewer, kSubscribeNoMesh, token_of('x'));
  }
  ASSERT_TRUE(until([&] { return server->gate().wrong_tokens() == 50; }));
  EXPECT_EQ(join_raw(Role::kOperator, token_of('o')), ErrorCode{})
      << "from the same address, at the same time";
  for (const auto& guesser : guessers) EXPECT_EQ(answer_to(*guesser), ErrorCode::kUnauthorised);
  before.take();
  EXPECT_FALSE(before.is_ended());
}

TEST_F(AccessTest, SilentConnectionsKeepNobodyOut) {
  ServerOptions options = with_tokens();
  options.max_clients = 4;
  start_http(options);
  std::vector<std::unique_ptr<RawPeer>> silent;
  const auto silent_peers = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const bool is_http = i % 2 == 0;
      silent.push_back(std::make_unique<RawPeer>(io, is_http ? http->port() : server->port(), 0, TlsContext(),
                                                 "127.0.0." + std::to_string(1 + i % 3)));
      io.poll();
    }
  };
  silent_peers(300);
  EXPECT_GE(server->gate().shed(), 300 - Gate::kMaxWaiting);
  for (const Role role : {Role::kOperator, Role::kDevice, Role::kViewer}) {
    EXPECT_EQ(join_raw(role, token_of('o')), ErrorCode{});
    silent_peers(20);
  }
  EXPECT_EQ(get("/").status, 200);
}

TEST_F(AccessTest, ATokenIsInNoLogAndNoMessage) {
  start(with_tokens());
  ClientOptions options;
  options.token = token_of('o');
  options.role = Role::kDevice;
  const auto device = join(options);
  ASSERT_TRUE(until([&] { return device->welcomes == 1; }));
  join_raw(Role::kViewer, token_of('x'));
  ASSERT_TRUE(until([&] { return !device->states.empty(); }));
  device->client.close();
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  std::string said;
  for (const std::string& line : log) said += line;
  for (const EventMessage& event : device->events) said += event.text;
  for (const StateMessage& state : device->states) said += state.device_holder;
  EXPECT_NE(said, "");
  for (const char c : {'o', 'x'}) {
    EXPECT_EQ(said.find(std::string(8, c)), std::string::npos);
    EXPECT_EQ(said.find(to_hex(token_of(c)).substr(0, 8)), std::string::npos);
  }
  EXPECT_FALSE(device->client.is_open());
}

TEST_F(AccessTest, AllListenersShareThePlacesAndTellWhoComesTooLate) {
  ServerOptions options;
  options.max_clients = 3;
  options.drain_timeout = std::chrono::milliseconds(50);
  start_http(options);
  start_igtl();
  RawPeer native(io, server->port());
  native.hello(Role::kViewer, kSubscribeNoMesh);
  EXPECT_EQ(answer_to(native), ErrorCode{});
  const auto browser = open_page();
  browser->hello(Role::kViewer, kSubscribeNoMesh);
  EXPECT_EQ(answer_to(*browser), ErrorCode{});
  IgtlPeer slicer(io, igtl->port());
  ASSERT_TRUE(until([&] { return server->client_count() == 2 && igtl->client_count() == 1; }));
  RawPeer late_native(io, server->port());
  EXPECT_EQ(answer_to(late_native), ErrorCode::kBusy);
  const HttpReply busy = get("/");
  EXPECT_EQ(busy.status, 503);
  EXPECT_EQ(busy.body, "all 3 client slots are in use\n");
  EXPECT_EQ(busy.headers.at("retry-after"), "1");
  const auto page = open_page();
  EXPECT_EQ(answer_to(*page), ErrorCode::kBusy);
  EXPECT_TRUE(ends(*page));
  EXPECT_EQ(page->close_code(), 1000);
  IgtlPeer late(io, igtl->port());
  ASSERT_TRUE(until([&] {
    late.take();
    return late.is_ended();
  }));
  EXPECT_EQ(late.last("STATUS").status().code, igtl::StatusCode::kBusy);
  slicer.close();
  ASSERT_TRUE(until([&] { return igtl->client_count() == 0; }));
  EXPECT_EQ(get("/").status, 200);
}

TEST_F(AccessTest, OneAddressTakesNoMoreThanItsPlaces) {
  ServerOptions options;
  options.max_clients_per_address = 2;
  start_http(options);
  start_igtl();
  RawPeer native(io, server->port(), 0, {}, "127.0.0.2"), slicer(io, igtl->port(), 0, {}, "127.0.0.3");
  native.hello(Role::kViewer, kSubscribeNoMesh);
  ASSERT_TRUE(until([&] { return server->client_count() == 1 && igtl->client_count() == 1; }));
  EXPECT_EQ(answer_to(native), ErrorCode{});
  RawPeer third(io, server->port(), 0, {}, "127.0.0.4");
  EXPECT_EQ(answer_to(third), ErrorCode::kBusy);
  EXPECT_NE(third.errors.at(0).text.find("the loopback"), std::string::npos);
  native.close();
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  EXPECT_EQ(join_raw(Role::kViewer, std::nullopt, "127.0.0.2"), ErrorCode{});
}

TEST_F(AccessTest, AHundredAtOnceGetThePlacesThereAreAndTheRestIsToldBusy) {
  ServerOptions options;
  options.max_clients = 64;
  options.max_clients_per_address = 64;
  start(options);
  std::vector<std::unique_ptr<RawPeer>> peers;
  for (int i = 0; i < 100; ++i) {
    peers.push_back(std::make_unique<RawPeer>(io, server->port()));
    peers.back()->hello(Role::kViewer, kSubscribeNoMesh);
    io.poll();
  }
  const auto count = [&](auto&& is) { return std::count_if(peers.begin(), peers.end(), is); };
  ASSERT_TRUE(until([&] {
    for (const auto& peer : peers) peer->take();
    return count([](const auto& p) { return p->is_ended(); }) == 36 &&
           count([](const auto& p) { return !p->types.empty() && p->types[0] == MessageType::kWelcome; }) ==
               64;
  }));
  const auto refused = count([](const auto& p) { return p->fatal() == ErrorCode::kBusy; });
  EXPECT_EQ(refused, 36);
  publish();
  EXPECT_EQ(server->client_count(), 64u);
}

TEST_F(AccessTest, ARemoteAddressNeedsATokenAndTls) {
  const auto refusal = [&](const ServerOptions& options) -> std::string {
    try {
      start(options);
      return "";
    } catch (const UserError& e) {
      return e.what();
    }
  };
  const auto holds = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  ServerOptions options = with_tokens();
  options.address = "0.0.0.0";
  const std::string without_tls = refusal(options);
  EXPECT_TRUE(holds(without_tls, "server.tls_certificate")) << without_tls;
  EXPECT_FALSE(holds(without_tls, "server.token_file")) << without_tls;
  options.tls = some_tls();
  EXPECT_EQ(refusal(options), "");
  options.tokens = {};
  const std::string without_token = refusal(options);
  EXPECT_TRUE(holds(without_token, "server.token_file")) << without_token;
  EXPECT_FALSE(holds(without_token, "server.tls_certificate")) << without_token;
  options.tls.reset();
  const std::string without_both = refusal(options);
  EXPECT_TRUE(holds(without_both, "server.token_file") && holds(without_both, "server.tls_certificate") &&
              holds(without_both, "--insecure-allow-remote"))
      << without_both;
}

TEST_F(AccessTest, OpenIgtLinkStaysOnLoopbackAndAsksForConsentWhereThereAreTokens) {
  ServerOptions options = with_tokens();
  options.address = "0.0.0.0";
  options.tls = some_tls();
  start(options);
  try {
    IgtlServer(io, IgtlOptions{}, *server, tissue, [](const std::string&) {});
    FAIL();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("igtl_without_token"), std::string::npos) << e.what();
  }
  start_igtl();
  EXPECT_EQ(igtl->address(), "127.0.0.1");
  igtl.reset();
  options.allow_remote = true;
  start(options);
  start_igtl();
  EXPECT_EQ(igtl->address(), "0.0.0.0");
  igtl.reset();
  options.address = "127.0.0.2";
  start(options);
  start_igtl();
  EXPECT_EQ(igtl->address(), "127.0.0.2");
}

}  // namespace
}  // namespace brachy::net::test
