#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <string>
#include <vector>

#include "net/base/clock.h"
#include "net/transport/connection.h"

namespace brachy::net {

/// Connection over TCP. `send_buffer_bytes` is SO_SNDBUF; what else is set: tcp_socket.h.
class TcpConnection final : public Connection, public std::enable_shared_from_this<TcpConnection> {
 public:
  TcpConnection(boost::asio::ip::tcp::socket socket, Clock& clock, int send_buffer_bytes,
                std::size_t read_buffer_bytes);

  void start(std::shared_ptr<ConnectionListener> listener) override;
  void write(Bytes header, std::shared_ptr<const Bytes> body) override;
  void shutdown_send() override;
  void close() override;
  std::int64_t last_progress_ns() const override { return last_progress_ns_; }
  std::int64_t last_waited_progress_ns() const override { return last_waited_progress_ns_; }
  std::size_t unsent_bytes() const override;
  const std::string& peer() const override { return peer_; }

 private:
  void read_some();
  void write_some(bool has_waited);
  void lost(const boost::system::error_code& error);

  mutable boost::asio::ip::tcp::socket socket_;  // native_handle() is not const
  Clock& clock_;
  std::string peer_;
  std::shared_ptr<ConnectionListener> listener_;  // null once closed
  std::vector<std::byte> read_buffer_;
  Bytes header_;
  std::shared_ptr<const Bytes> body_;
  std::size_t written_ = 0;  // of header and body
  std::int64_t last_progress_ns_ = 0;
  std::int64_t last_waited_progress_ns_ = 0;
};

}  // namespace brachy::net
