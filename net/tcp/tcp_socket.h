#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstddef>
#include <string>

namespace brachy::net {

// What every transport over a TCP socket does with it.

/// "address:port" of the other end.
std::string peer_of(const boost::asio::ip::tcp::socket& socket);

/// Non-blocking, TCP_NODELAY, and a send buffer of `send_buffer_bytes`, so that little stale mesh waits in the kernel.
/// Errors are ignored: the connection still works.
void set_up(boost::asio::ip::tcp::socket& socket, int send_buffer_bytes);

/// Bytes that were written and have not left this machine, because the peer has no room for them.
std::size_t unsent_bytes(boost::asio::ip::tcp::socket& socket);

}  // namespace brachy::net
