#include "tests/net/http/http_testing.h"

#include <stdlib.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace brachy::net::test {

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "brachy_http_XXXXXX").string();
  if (!::mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

void TemporaryFolder::write(const std::string& name, const std::string& content) const {
  std::ofstream(path_ / name, std::ios::binary) << content;
}

void HttpPeer::take() {
  socket_.take(SIZE_MAX, [this](std::span<const std::byte> bytes) {
    for (const std::byte byte : bytes) unread_ += static_cast<char>(std::to_integer<unsigned char>(byte));
  });
}

bool HttpPeer::next(HttpReply& reply, bool to_head) {
  const std::size_t end = unread_.find("\r\n\r\n");
  if (end == std::string::npos) return false;
  reply = {};
  reply.status = std::stoi(unread_.substr(unread_.find(' ') + 1));
  for (std::size_t at = unread_.find("\r\n") + 2; at < end + 2;) {
    const std::size_t line_end = unread_.find("\r\n", at);
    const std::string line = unread_.substr(at, line_end - at);
    std::string name = line.substr(0, line.find(':'));
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
    reply.headers[name] = line.substr(line.find(':') + 2);
    at = line_end + 2;
  }
  const auto length = reply.headers.find("content-length");
  const std::size_t size = to_head || length == reply.headers.end() ? 0 : std::stoul(length->second);
  if (unread_.size() < end + 4 + size) return false;
  reply.body = unread_.substr(end + 4, size);
  unread_.erase(0, end + 4 + size);
  return true;
}

void HttpFixture::start_http(ServerOptions options, HttpOptions http_options, ServedFiles files) {
  start(options);
  http = std::make_unique<HttpListener>(io, *server, http_options, std::move(files),
                                        [this](const std::string& line) { log.push_back(line); });
}

HttpReply HttpFixture::get(const std::string& target, const std::string& more, const std::string& method) {
  const HttpReply reply =
      ask(method + " " + target + " HTTP/1.1\r\n" + host_line() + more + "\r\n", method == "HEAD");
  EXPECT_NE(reply.status, 0) << method << " " << target;
  return reply;
}

HttpReply HttpFixture::ask(const std::string& request, bool to_head) {
  HttpPeer peer(io, http->port(), tls);
  peer.send(request);
  HttpReply reply;
  EXPECT_TRUE(until([&] {
    peer.take();
    return peer.next(reply, to_head) || peer.is_ended();
  }));
  return reply;
}

bool HttpFixture::ends(HttpPeer& peer) {
  return until([&] {
    peer.take();
    return peer.is_ended();
  });
}

std::unique_ptr<WebSocketPeer> HttpFixture::open_page(int receive_buffer) {
  auto page = std::make_unique<WebSocketPeer>(io, http->port(), receive_buffer, tls);
  EXPECT_TRUE(until([&] {
    page->take();
    return page->is_open();
  })) << page->answer();
  return page;
}

std::unique_ptr<WebSocketPeer> HttpFixture::join_page(Role role, std::uint32_t subscription) {
  auto page = open_page();
  page->hello(role, subscription);
  EXPECT_TRUE(until([&] {
    page->take();
    return !page->types.empty() || page->is_ended();
  }));
  return page;
}

bool HttpFixture::ends(WebSocketPeer& page) {
  return until([&] {
    page.take();
    return page.is_ended();
  });
}

}  // namespace brachy::net::test
