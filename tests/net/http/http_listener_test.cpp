#include "net/http/http_listener.h"

#include "core/base/error.h"
#include "tests/net/http/http_testing.h"

namespace brachy::net::test {
namespace {

struct HttpListenerTest : HttpFixture {
  HttpListenerTest() {
    folder.write("index.html", page);
    folder.write("index.html.gz", "packed");
  }
  void serve(HttpOptions options = {}) { start_http({}, options, ServedFiles(folder.path())); }

  const std::string page = "<p>" + std::string(300'000, 'x');
  TemporaryFolder folder;
};

TEST_F(HttpListenerTest, ServesThePageWithHeadersThatKeepOthersOut) {
  serve();
  HttpReply reply = get("/");
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, page);
  EXPECT_EQ(reply.headers["content-type"], "text/html; charset=utf-8");
  EXPECT_EQ(reply.headers["content-length"], std::to_string(page.size()));
  EXPECT_EQ(reply.headers["x-content-type-options"], "nosniff");
  EXPECT_EQ(reply.headers["cache-control"], "no-cache");
  EXPECT_TRUE(reply.headers["content-security-policy"].starts_with("default-src 'none'; "));
  EXPECT_NE(reply.headers["content-security-policy"].find("frame-ancestors 'none'"), std::string::npos);
  EXPECT_FALSE(reply.headers.contains("content-encoding"));
}

TEST_F(HttpListenerTest, SendsItPackedToWhoTakesThat) {
  serve();
  HttpReply reply = get("/", "Accept-Encoding: gzip, deflate, br\r\n");
  EXPECT_EQ(reply.body, "packed");
  EXPECT_EQ(reply.headers["content-encoding"], "gzip");
  EXPECT_EQ(reply.headers["content-type"], "text/html; charset=utf-8");
  EXPECT_EQ(reply.headers["vary"], "Accept-Encoding");
  EXPECT_EQ(get("/", "Accept-Encoding: gzip;q=0\r\n").body, page);
}

TEST_F(HttpListenerTest, HeadIsGetWithoutTheBody) {
  serve();
  HttpReply head = get("/", "", "HEAD"), reply = get("/");
  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.body, "");
  EXPECT_EQ(head.headers, reply.headers);
  EXPECT_EQ(get("/nothing", "", "HEAD").status, 404);
}

TEST_F(HttpListenerTest, WhoHasItAlreadyIsToldSo) {
  serve();
  const std::string tag = get("/").headers["etag"];
  HttpReply again = get("/", "If-None-Match: W/\"other\", " + tag + "\r\n");
  EXPECT_EQ(again.status, 304);
  EXPECT_EQ(again.body, "");
  EXPECT_EQ(again.headers["etag"], tag);
  EXPECT_EQ(get("/", "If-None-Match: " + tag + "\r\nAccept-Encoding: gzip\r\n").status,
            200);  // the packed one is another
}

TEST_F(HttpListenerTest, AnswersRequestAfterRequestOnOneConnectionButNotForEver) {
  serve();
  HttpPeer peer(io, http->port());
  const std::string request = "GET /nothing HTTP/1.1\r\n" + host_line() + "\r\n";
  std::string all;
  for (int i = 0; i < 101; ++i) all += request;  // at once: they wait for each other
  ASSERT_TRUE(peer.send(all));
  ASSERT_TRUE(ends(peer));
  HttpReply reply;
  int answered = 0;
  while (peer.next(reply)) {
    EXPECT_EQ(reply.status, 404);
    EXPECT_EQ(reply.headers["connection"] == "close", ++answered == 100);
  }
  EXPECT_EQ(answered, 100);
}

TEST_F(HttpListenerTest, ClosesWhenAskedTo) {
  serve();
  HttpPeer peer(io, http->port());
  peer.send("GET / HTTP/1.1\r\n" + host_line() + "Connection: close\r\n\r\n");
  ASSERT_TRUE(ends(peer));
  HttpReply reply;
  ASSERT_TRUE(peer.next(reply));
  EXPECT_EQ(reply.body, page);
  HttpPeer old(io, http->port());
  old.send("GET / HTTP/1.0\r\n" + host_line() + "\r\n");
  ASSERT_TRUE(ends(old));
  EXPECT_TRUE(old.next(reply));
}

TEST_F(HttpListenerTest, OtherMethodsPathsAndBodiesAreRefusedInWords) {
  serve();
  for (const auto* method : {"POST", "PUT", "DELETE", "OPTIONS", "BREW"}) {
    HttpReply reply = get("/", "", method);
    EXPECT_EQ(reply.status, 405) << method;
    EXPECT_EQ(reply.headers["allow"], "GET, HEAD");
  }
  for (const auto* path : {"/nothing", "/../index.html", "/..%2f..%2fetc/passwd", "/%2e%2e/etc/passwd",
                           "//etc/passwd", "/index.html/../../x", "/WS"}) {
    const HttpReply reply = get(path);
    EXPECT_EQ(reply.status, 404) << path;
    EXPECT_NE(reply.body, "");
  }
  EXPECT_EQ(get("http://127.0.0.1/").status, 400);
  EXPECT_EQ(get("*").status, 400);
  EXPECT_EQ(get("/", "Content-Length: 3\r\n").status, 413);
  EXPECT_EQ(get("/", "Transfer-Encoding: chunked\r\n").status, 413);
  for (const char* unknown : {"xchunked", "gzip", "chunked, identity", "chunkedx", "identity"})
    EXPECT_EQ(get("/", std::string("Transfer-Encoding: ") + unknown + "\r\n").status, 501) << unknown;
  EXPECT_EQ(get("/", "Content-Length: 0\r\n").status, 200);
  HttpReply no_upgrade = get("/ws");
  EXPECT_EQ(no_upgrade.status, 426);
  EXPECT_EQ(no_upgrade.headers["upgrade"], "websocket");
}

TEST_F(HttpListenerTest, AnswersOnlyUnderANameOfThisMachineAndToItsOwnPage) {
  serve();
  EXPECT_EQ(ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n").status, 403);
  EXPECT_EQ(ask("GET / HTTP/1.1\r\nHost: localhost:4321\r\n\r\n").status, 200);
  EXPECT_EQ(ask("GET / HTTP/1.1\r\n\r\n").status, 400);
  EXPECT_EQ(ask("GET / HTTP/1.1\r\n" + host_line() + "Host: localhost\r\n\r\n").status, 400);
  EXPECT_EQ(get("/", "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(get("/", "Origin: http://127.0.0.1:" + std::to_string(http->port()) + "\r\n").status, 200);
}

TEST_F(HttpListenerTest, APortInUseIsNamedWithTheOptionForAnother) {
  serve();
  try {
    HttpOptions options;
    options.port = http->port();
    HttpListener second(io, *server, options, {}, {});
    FAIL();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("port " + std::to_string(http->port())), std::string::npos)
        << e.what();
    EXPECT_NE(std::string(e.what()).find("--http-port"), std::string::npos) << e.what();
  }
}

TEST_F(HttpListenerTest, StoppingLeavesNothingToWaitFor) {
  serve();
  HttpPeer idle(io, http->port()), half(io, http->port());
  half.send("GET / HT");
  HttpPeer reading(io, http->port());
  reading.send("GET / HTTP/1.1\r\n" + host_line() + "\r\n");
  const auto page_peer = join_page();
  ASSERT_TRUE(until([&] { return server->client_count() == 1; }));
  const std::int64_t begin_ns = clock.now_ns();
  server->stop();
  http->stop();
  ASSERT_TRUE(until([&] { return io.stopped(); })) << "something is left to run";
  EXPECT_LT(clock.now_ns() - begin_ns, in_ns(std::chrono::milliseconds(1900)));
  EXPECT_TRUE(ends(*page_peer));
  EXPECT_EQ(page_peer->fatal(), ErrorCode::kShutdown);
  EXPECT_EQ(page_peer->close_code(), 1000);
  EXPECT_TRUE(ends(idle) && ends(half));
}

TEST_F(HttpListenerTest, PagesAreMadeForEachRequestUnderTheSameRules) {
  int made = 0;
  HttpOptions options;
  options.pages["/count"].make = [&] {
    return DynamicPage::Content{200, "text/plain", std::to_string(++made)};
  };
  options.pages["/ill"].make = [&] { return DynamicPage::Content{503, "text/plain", "ill\n"}; };
  serve(options);
  HttpReply first = get("/count"), second = get("/count?again");
  EXPECT_EQ(first.status, 200);
  EXPECT_EQ(first.body, "1");
  EXPECT_EQ(first.headers["content-type"], "text/plain");
  EXPECT_EQ(first.headers["cache-control"], "no-store");
  EXPECT_EQ(second.body, "2");
  EXPECT_EQ(get("/ill").status, 503);
  EXPECT_EQ(get("/count", "", "HEAD").body, "");
  EXPECT_EQ(get("/counts").status, 404);
  EXPECT_EQ(ask("POST /count HTTP/1.1\r\n" + host_line() + "\r\n").status, 405);
  EXPECT_EQ(ask("GET /count HTTP/1.1\r\nHost: elsewhere.example\r\n\r\n").status, 403);
  EXPECT_EQ(made, 3);
}

TEST_F(HttpListenerTest, APageMayHaveOthersBelowIt) {
  HttpOptions options;
  options.pages["/all"].make = [] { return DynamicPage::Content{200, "text/plain", "all"}; };
  options.pages["/all/"].make_below = [](std::string_view rest) {
    return DynamicPage::Content{200, "text/plain", "<" + std::string(rest) + ">"};
  };
  serve(options);
  EXPECT_EQ(get("/all").body, "all");
  EXPECT_EQ(get("/all/").body, "<>");
  EXPECT_EQ(get("/all/a%20b/c.txt?query").body, "<a%20b/c.txt>");
  EXPECT_EQ(get("/all/../x").body, "<../x>") << "as it came: whoever makes the page judges it";
  EXPECT_EQ(get("/other/x").status, 404);
}

}  // namespace
}  // namespace brachy::net::test
