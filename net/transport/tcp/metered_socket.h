#pragma once

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/compose.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <cstdint>
#include <utility>

#include "net/base/clock.h"
#include "net/wire/byte_io.h"

namespace brachy::net {

/// A socket for Asio's and Beast's composed operations, which notes when it gets rid of bytes. It must be non-blocking
/// (set_up in tcp_socket.h), and stay where it is while an operation runs. Threads: the io thread.
struct MeteredSocket {
  using executor_type = boost::asio::ip::tcp::socket::executor_type;
  executor_type get_executor() { return socket.get_executor(); }

  // What Asio's TLS stream asks for.
  using lowest_layer_type = boost::asio::ip::tcp::socket;
  lowest_layer_type& lowest_layer() { return socket; }

  /// Reads `unread` first.
  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return boost::asio::async_compose<Handler, void(boost::system::error_code, std::size_t)>(
        [this, buffers, is_begun = false](auto& self, boost::system::error_code error = {},
                                          std::size_t size = 0) mutable {
          if (std::exchange(is_begun, true)) return self.complete(error, size);
          const auto into = buffers;  // self, which has the others, is moved
          if (unread.empty()) return socket.async_read_some(into, std::move(self));
          const std::size_t taken = boost::asio::buffer_copy(into, boost::asio::buffer(unread));
          unread.erase(unread.begin(), unread.begin() + static_cast<std::ptrdiff_t>(taken));
          boost::asio::post(socket.get_executor(), [self = std::move(self), taken]() mutable {
            self.complete(boost::system::error_code(), taken);
          });
        },
        handler, socket);
  }

  /// Writes at once if the send buffer has space, else once it has; so it detects a peer that it has to wait for.
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    enum class Step { kTry, kWaited, kPosted };
    return boost::asio::async_compose<Handler, void(boost::system::error_code, std::size_t)>(
        [this, buffers, step = Step::kTry, size = std::size_t{0}, result = boost::system::error_code()](
            auto& self, boost::system::error_code error = {}) mutable {
          if (step == Step::kPosted) return self.complete(result, size);
          if (!error) size = socket.write_some(buffers, error);
          if (error == boost::asio::error::would_block || error == boost::asio::error::try_again) {
            step = Step::kWaited;
            return socket.async_wait(socket.wait_write, std::move(self));
          }
          if (size > 0) {
            last_progress_ns = clock->now_ns();
            if (was_full || step == Step::kWaited) last_waited_progress_ns = last_progress_ns;
            was_full = size < boost::asio::buffer_size(buffers);
          }
          if (step == Step::kWaited) return self.complete(error, size);
          step = Step::kPosted;
          result = error;
          boost::asio::post(socket.get_executor(), std::move(self));
        },
        handler, socket);
  }

  /// Closes, without waiting for the peer to do so. What it sent is read first: with bytes unread, Linux takes back
  /// what has not reached the peer, such as why we close.
  void end() {
    boost::system::error_code error;
    socket.shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
    std::array<char, 16 * 1024> ignored;
    for (int i = 0; i < 64 && !error; ++i) socket.read_some(boost::asio::buffer(ignored), error);
    socket.close(error);
  }

  boost::asio::ip::tcp::socket socket;
  Clock* clock;
  Bytes unread = {};  // received by someone else before
  std::int64_t last_progress_ns = 0;
  std::int64_t last_waited_progress_ns = 0;
  bool was_full = false;  // the last write did not fit into the send buffer
};

}  // namespace brachy::net
