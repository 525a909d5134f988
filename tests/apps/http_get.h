#pragma once

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <string>

#include "tests/apps/running_brachyd.h"

namespace brachy::test {

/// From the next line that brachyd prints; 0 without.
inline std::uint16_t http_port(RunningBrachyd& daemon) {
  constexpr std::string_view kSays = "{\"http_on\":\"127.0.0.1:";
  const auto line = daemon.process.read_line();
  if (!line || !line->starts_with(kSays)) {
    ADD_FAILURE() << "brachyd's second line: " << line.value_or("none");
    return 0;
  }
  return static_cast<std::uint16_t>(std::stoi(line->substr(kSays.size())));
}

/// The whole reply to a GET; `more`: header lines, each with its line end.
inline std::string http_get(std::uint16_t port, const std::string& target, const std::string& more = "") {
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket socket(io);
  socket.connect({boost::asio::ip::address_v4::loopback(), port});
  boost::asio::write(
      socket, boost::asio::buffer("GET " + target + " HTTP/1.1\r\nHost: localhost:" + std::to_string(port) +
                                  "\r\nConnection: close\r\n" + more + "\r\n"));
  std::string reply;
  boost::system::error_code end;
  boost::asio::read(socket, boost::asio::dynamic_buffer(reply), end);
  return reply;
}

inline std::string body_of(const std::string& reply) {
  const auto header_end = reply.find("\r\n\r\n");
  return header_end == std::string::npos ? "" : reply.substr(header_end + 4);
}

}  // namespace brachy::test
