#include "net/transport/tcp/tcp_connection.h"

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <cassert>
#include <utility>

#include "net/transport/tcp/tcp_socket.h"

namespace brachy::net {
namespace asio = boost::asio;
TcpConnection::TcpConnection(asio::ip::tcp::socket socket, Clock& clock, int send_buffer_bytes,
                             std::size_t read_buffer_bytes)
    : socket_(std::move(socket)), clock_(clock), peer_(peer_of(socket_)), read_buffer_(read_buffer_bytes) {
  set_up(socket_, send_buffer_bytes);
}

void TcpConnection::start(std::shared_ptr<ConnectionListener> listener) {
  listener_ = std::move(listener);
  read_some();
}

void TcpConnection::read_some() {
  socket_.async_read_some(
      asio::buffer(read_buffer_),
      [self = shared_from_this()](const boost::system::error_code& error, std::size_t size) {
        if (!self->listener_) return;
        if (error) return self->lost(error);
        const auto listener = self->listener_;  // on_bytes may close
        listener->on_bytes(std::span<const std::byte>(self->read_buffer_).first(size));
        if (self->listener_) self->read_some();
      });
}

void TcpConnection::write(Bytes header, std::shared_ptr<const Bytes> body) {
  assert(header_.empty());
  header_ = std::move(header);
  body_ = std::move(body);
  written_ = 0;
  last_progress_ns_ = clock_.now_ns();
  write_some(false);
}

void TcpConnection::write_some(bool has_waited) {
  const std::size_t body_size = body_ ? body_->size() : 0;
  boost::system::error_code error;
  while (!error && written_ < header_.size() + body_size) {
    const std::size_t from_header = std::min(written_, header_.size());
    const std::array<asio::const_buffer, 2> rest = {
        asio::buffer(header_) + from_header,
        body_size > 0 ? asio::buffer(*body_) + (written_ - from_header) : asio::const_buffer()};
    const std::size_t size = socket_.write_some(rest, error);
    written_ += size;
    if (size == 0) continue;
    last_progress_ns_ = clock_.now_ns();
    if (has_waited) last_waited_progress_ns_ = last_progress_ns_;
  }
  const auto self = shared_from_this();
  if (error == asio::error::would_block || error == asio::error::try_again) {
    socket_.async_wait(socket_.wait_write, [self](const boost::system::error_code& wait_error) {
      if (!self->listener_) return;
      if (wait_error) return self->lost(wait_error);
      self->write_some(true);
    });
    return;
  }
  header_.clear();
  body_.reset();
  asio::post(socket_.get_executor(), [self, error] {
    if (!self->listener_) return;
    if (error) return self->lost(error);
    const auto listener = self->listener_;  // on_written may close
    listener->on_written();
  });
}

std::size_t TcpConnection::unsent_bytes() const {
  return net::unsent_bytes(socket_);
}

void TcpConnection::shutdown_send() {
  boost::system::error_code ignored;
  socket_.shutdown(asio::socket_base::shutdown_send, ignored);
}

void TcpConnection::close() {
  listener_.reset();
  boost::system::error_code ignored;
  socket_.close(ignored);
}

void TcpConnection::lost(const boost::system::error_code& error) {
  const auto listener = std::exchange(listener_, nullptr);
  boost::system::error_code ignored;
  socket_.close(ignored);
  listener->on_closed(error == asio::error::eof ? "closed by the peer" : error.message());
}

}  // namespace brachy::net
