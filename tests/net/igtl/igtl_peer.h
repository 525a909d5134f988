#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "net/igtl/codec/codec.h"

namespace brachy::net::igtl::test {

/// What a peer was sent: whole, its CRC right and its extended header, if any, taken off.
struct Received {
  Header header;
  Bytes content;
  std::string metadata;  ///< of header version 2: keys and values, one after the other

  RigidTransform transform() const;                                ///< of a TRANSFORM
  Status status() const;                                           ///< of a STATUS
  std::vector<float> points() const;                               ///< of a POLYDATA
  std::vector<TrackedTool> tools() const;                          ///< of a TDATA
  std::vector<std::pair<std::string, Vec3>> named_points() const;  ///< of a POINT: names and positions, mm
};

/// The message with body size and CRC set to what its bytes are.
Bytes with_right_size_and_crc(Bytes message);

/// An OpenIGTLink client that sends any bytes, well-formed or not, and reads only on request.
class IgtlPeer {
 public:
  /// `receive_buffer` > 0 sets SO_RCVBUF, so that a peer that does not read soon blocks the server.
  IgtlPeer(boost::asio::io_context& io, std::uint16_t port, int receive_buffer = 0);

  /// Sends at once; false where the server has closed.
  bool send(std::span<const std::byte> bytes);
  /// A needle's pose with a stamp of its own, each later than the last.
  bool send_pose(const std::string& device, const RigidTransform& X, std::uint16_t version = 1);
  bool send_query(const std::string& type, const std::string& device = "", std::uint16_t version = 1);

  /// Reads what has come, `max_bytes` at most.
  void take(std::size_t max_bytes = SIZE_MAX);
  void close();

  bool is_ended() const { return is_ended_; }  ///< the server's end of the stream was read
  /// Of this type so far, and of this device where one is named.
  std::size_t count(const std::string& type, const std::string& device = "") const;
  const Received& last(const std::string& type, const std::string& device = "") const;

  std::vector<Received> received;

 private:
  boost::asio::ip::tcp::socket socket_;
  Bytes buffer_;
  std::int64_t stamp_ns_ = 1'700'000'000'000'000'000;
  bool is_ended_ = false;
};

}  // namespace brachy::net::igtl::test
