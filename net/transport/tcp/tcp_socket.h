#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <cstddef>
#include <string>

namespace brachy::net {

// What every transport over a TCP socket does with it.

/// "address:port" of the other end.
std::string peer_of(const boost::asio::ip::tcp::socket& socket);

/// The address alone; of an IPv4 peer on an IPv6 socket the IPv4 one.
std::string address_of_peer(const boost::asio::ip::tcp::socket& socket);

/// What may wait in this machine for a peer that reads too slowly: at 1 Mbit/s an eighth of a second of stale mesh.
/// What is on its way in the network does not count, so that fast links with long ways stay full.
constexpr int kMaxUnsentBytes = 16 * 1024;

/// Non-blocking, TCP_NODELAY, a send buffer of `send_buffer_bytes`, reported full (TCP_NOTSENT_LOWAT) while
/// kMaxUnsentBytes have not been sent, and SO_KEEPALIVE: a machine that no longer answers is noticed within 5 s where
/// nothing else asks, as over OpenIGTLink. Errors are ignored: the connection still works.
void set_up(boost::asio::ip::tcp::socket& socket, int send_buffer_bytes);

/// Bytes written that have not left this machine, because the peer's receive window is full.
std::size_t unsent_bytes(boost::asio::ip::tcp::socket& socket);

/// The peer has ended its stream, or the connection is broken; unread bytes stay.
bool has_left(boost::asio::ip::tcp::socket& socket);

}  // namespace brachy::net
