#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>
#include <string>

#include "net/base/clock.h"

namespace brachy::net {

/// A socket of `io` connected to host:port. Blocks, at most about `timeout` and the name's look-up, and runs nothing of
/// `io` meanwhile. Throws UserError that names the fix.
boost::asio::ip::tcp::socket connect_tcp(boost::asio::io_context& io, const std::string& host,
                                         std::uint16_t port, TimerClock& clock,
                                         std::chrono::milliseconds timeout);

}  // namespace brachy::net
