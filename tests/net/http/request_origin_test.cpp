#include "net/http/request_origin.h"

#include <gtest/gtest.h>

namespace brachy::net {
namespace {

using boost::asio::ip::make_address;
const auto kLoopback = make_address("127.0.0.1");

bool passes(std::string_view host, std::optional<std::string_view> origin = {},
            const boost::asio::ip::address& bound = kLoopback) {
  return refusal_of_origin(host, origin, bound, false).empty();
}
bool passes_over_tls(std::string_view host, std::optional<std::string_view> origin = {}) {
  return refusal_of_origin(host, origin, kLoopback, true).empty();
}

TEST(RequestOrigin, NamesOfThisMachineAreHosts) {
  for (const auto* host : {"127.0.0.1:18951", "127.0.0.1", "127.1.2.3:80", "localhost", "localhost:18951",
                           "LocalHost:1", "[::1]", "[::1]:18951"})
    EXPECT_TRUE(passes(host)) << host;
}

TEST(RequestOrigin, AnotherNameIsNoHostWhateverItResolvesTo) {
  for (const auto* host :
       {"evil.example", "evil.example:18951", "localhost.evil.example", "127.0.0.1.evil.example",
        "192.168.1.5:18951", "0.0.0.0", "2130706433", "127.1", "[::ffff:127.0.0.1]", "[::2]"})
    EXPECT_FALSE(passes(host)) << host;
}

TEST(RequestOrigin, WhatIsNoHostIsRefused) {
  for (const auto* host :
       {"", ":80", "localhost:", "localhost:123456", "localhost:8x", "[::1", "[]", "localhost@evil:80",
        "localhost evil", "[::1]evil", "127.0.0.1:80:80", "localhost/"})
    EXPECT_FALSE(passes(host)) << host;
}

TEST(RequestOrigin, TheAddressThatWasBoundIsAHost) {
  const auto bound = make_address("192.168.1.5");
  EXPECT_TRUE(passes("192.168.1.5:18951", {}, bound));
  EXPECT_TRUE(passes("127.0.0.1:18951", {}, bound));
  EXPECT_FALSE(passes("192.168.1.6:18951", {}, bound));
  EXPECT_TRUE(passes("[fe80::1]:18951", {}, make_address("fe80::1")));
}

TEST(RequestOrigin, ThePageThatWasServedHereMayConnectAlsoThroughATunnel) {
  EXPECT_TRUE(passes("127.0.0.1:18951", "http://127.0.0.1:18951"));
  EXPECT_TRUE(passes("localhost:8080", "http://localhost:8080"));  // ssh -L 8080:127.0.0.1:18951
  EXPECT_TRUE(passes("localhost", "https://localhost"));
  EXPECT_TRUE(passes("LOCALHOST:80", "http://localhost:80"));
}

TEST(RequestOrigin, PagesOfOtherSitesMayNot) {
  for (const auto* origin :
       {"http://evil.example", "http://evil.example:18951", "http://127.0.0.1:18952", "null", "",
        "http://127.0.0.1", "file://", "127.0.0.1:18951", "ftp://127.0.0.1:18951",
        "http://127.0.0.1:18951.evil.example", "http://127.0.0.1:18951/",
        "http://evil.example@127.0.0.1:18951", "http://https://127.0.0.1:18951"})
    EXPECT_FALSE(passes("127.0.0.1:18951", origin)) << origin;
}

TEST(RequestOrigin, OverTlsTheBrowserHasCheckedTheName) {
  EXPECT_TRUE(passes_over_tls("simulator.example:18951"));
  EXPECT_TRUE(passes_over_tls("simulator.example:18951", "https://simulator.example:18951"));
  EXPECT_TRUE(passes_over_tls("127.0.0.1:18951", "https://127.0.0.1:18951"));
  EXPECT_FALSE(passes_over_tls("simulator.example:8x"));
}

TEST(RequestOrigin, OverTlsAPageThatAnybodyOnTheWayCouldHaveMadeMayNot) {
  for (const auto* origin : {"http://simulator.example:18951", "https://evil.example",
                             "https://simulator.example", "https://simulator.example:18952", "null"})
    EXPECT_FALSE(passes_over_tls("simulator.example:18951", origin)) << origin;
}

}  // namespace
}  // namespace brachy::net
