// Any bytes sent to the HTTP port, over a socket: every answer is HTTP, and the connection is closed afterwards.
#include <algorithm>
#include <array>

#include "tests/fuzz/fuzzing.h"
#include "tests/net/http/http_testing.h"

namespace brachy::fuzz {
namespace {

using namespace net;

/// A server with an HTTP port, for all inputs.
struct Page {
  net::test::ManualClock clock;
  boost::asio::io_context io;
  Tissue tissue = net::test::line_tissue(4);
  Server server{io, options(), tissue, {}};
  HttpListener http{io, server, pages(), {}, [](const std::string&) {}};

  ServerOptions options() {
    ServerOptions options;
    options.clock = &clock;
    return options;
  }
  static HttpOptions pages() {
    HttpOptions options;  // the server has no tokens: one that is presented is parsed nevertheless
    options.pages["/metrics"].make = [] { return DynamicPage::Content{200, "text/plain", "made\n"}; };
    return options;
  }
};

void expect_answer(const net::test::HttpReply& reply) {
  constexpr std::array kAnswers = {101, 200, 304, 400, 403, 404, 405, 413, 426, 431, 501};
  EXPECT_TRUE(std::ranges::count(kAnswers, reply.status)) << reply.status;
  if (reply.status == 200)
    EXPECT_TRUE(reply.headers.contains("etag") || reply.headers.contains("cache-control"));
  // Beast itself answers an upgrade that does not follow RFC 6455.
  constexpr std::array kBeasts = {101, 400, 426};
  if (!std::ranges::count(kBeasts, reply.status))
    EXPECT_TRUE(reply.headers.contains("x-content-type-options"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Page page;
  {
    net::test::HttpPeer peer(page.io, page.http.port());
    const std::string request = text_of(std::as_bytes(std::span(data, size)));
    for (std::size_t at = 0; at < size && !peer.is_ended(); at += 700) {
      peer.send(request.substr(at, 700));
      while (page.io.poll() > 0) continue;
      peer.take();
    }
    net::test::HttpReply reply;
    if (peer.next(reply, true)) expect_answer(reply);
  }
  EXPECT_TRUE(net::test::pump_turns(
      page.io, [&] { return page.server.client_count() == 0; },
      [&] { page.clock.advance(std::chrono::milliseconds(5)); }));
  return 0;
}

}  // namespace brachy::fuzz
