#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <climits>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "net/wire/byte_io.h"

namespace brachy::fuzz {

/// The daemon's three listeners.
struct Doors {
  std::uint16_t native = 0, http = 0, igtl = 0;
};

/// What a hostile client sends over one connection: first well-formed messages, then others.
struct Conversation {
  struct Send {
    net::Bytes bytes;
    bool is_mutated = false;
  };
  std::uint16_t port = 0;
  std::vector<Send> sends;  ///< in this order, each maybe in pieces
};
Conversation make_conversation(const Doors& doors, std::mt19937& random);
/// A viewer's that wants every frame in full.
Conversation greedy_conversation(const Doors& doors);

/// One connection that plays a conversation. Nothing in it waits.
class HostilePeer {
 public:
  HostilePeer(boost::asio::io_context& io, Conversation conversation, std::mt19937& random);
  /// Reads nothing and stays.
  void be_deaf() { reads_ = false, lingers_ = true, turns_left_ = INT_MAX; }

  /// Sends the next piece and may read; false once it is over and the connection closed.
  bool step();
  std::size_t mutated_sent() const { return mutated_sent_; }  ///< whole

 private:
  void read();
  bool end();

  Conversation conversation_;
  std::mt19937& random_;
  boost::asio::ip::tcp::socket socket_;
  std::size_t sent_ = 0, at_ = 0;  // messages, and bytes of the next
  std::size_t mutated_sent_ = 0;
  bool reads_, resets_, lingers_;
  int turns_left_ = 60;
  bool is_ended_ = false;  // the daemon's end of the stream was read, or an error
};

}  // namespace brachy::fuzz
