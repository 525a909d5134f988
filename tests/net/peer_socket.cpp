#include "tests/net/peer_socket.h"

#include <openssl/err.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/write.hpp>
#include <utility>
#include <vector>

#include "tests/wait.h"

namespace brachy::net::test {

using boost::asio::ip::tcp;

PeerSocket::PeerSocket(boost::asio::io_context& io, std::uint16_t port, int receive_buffer, TlsContext tls,
                       const std::string& from)
    : socket_(io), context_(std::move(tls)) {
  boost::system::error_code error;
  do {
    socket_ = tcp::socket(io, tcp::v4());
    if (receive_buffer > 0) socket_.set_option(boost::asio::socket_base::receive_buffer_size(receive_buffer));
    socket_.bind({boost::asio::ip::make_address(from), 0});
    socket_.connect({boost::asio::ip::address_v4::loopback(), port}, error);
  } while (error == boost::asio::error::interrupted);  // by libFuzzer's clock
  if (error) throw boost::system::system_error(error, "connect");
  socket_.set_option(tcp::no_delay(true));
  if (!context_) return;
  tls_.reset(SSL_new(context_->native_handle()));
  SSL_set_bio(tls_.get(), BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));  // input, output
  SSL_set_connect_state(tls_.get());
  go_on();
}

PeerSocket::~PeerSocket() = default;

bool PeerSocket::send_raw(std::span<const std::byte> bytes) {
  boost::system::error_code error;
  boost::asio::write(socket_, boost::asio::buffer(bytes.data(), bytes.size()), error);
  return !error;
}

bool PeerSocket::send(std::span<const std::byte> bytes) {
  if (!tls_) return send_raw(bytes);
  if (is_ended_) return false;
  waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  go_on();
  return flush();
}

std::size_t PeerSocket::take(std::size_t max_bytes, const Taker& taker) {
  std::vector<std::byte> buffer(std::min<std::size_t>(max_bytes, 64 * 1024));
  std::size_t taken = 0;
  boost::system::error_code error;
  socket_.non_blocking(true, error);
  while (taken < max_bytes && !is_ended_) {
    const std::size_t size = socket_.read_some(
        boost::asio::buffer(buffer.data(), std::min(max_bytes - taken, buffer.size())), error);
    if (error == boost::asio::error::would_block) break;
    if (error) {
      is_ended_ = true;
      break;
    }
    taken += size;
    const auto bytes = std::span<const std::byte>(buffer).first(size);
    tls_ ? decrypt(bytes, taker) : taker(bytes);
  }
  socket_.non_blocking(false, error);
  if (tls_) flush();
  return taken;
}

void PeerSocket::decrypt(std::span<const std::byte> bytes, const Taker& taker) {
  BIO_write(SSL_get_rbio(tls_.get()), bytes.data(), static_cast<int>(bytes.size()));
  go_on();
  std::array<std::byte, 16 * 1024> plain;
  while (is_secure() && !is_ended_) {
    ERR_clear_error();
    const int size = SSL_read(tls_.get(), plain.data(), static_cast<int>(plain.size()));
    if (size <= 0) return fail(size);
    taker(std::span<const std::byte>(plain).first(static_cast<std::size_t>(size)));
  }
}

/// Continues the handshake, and then sends what waited for its end.
void PeerSocket::go_on() {
  ERR_clear_error();
  if (!is_secure()) {
    if (const int result = SSL_do_handshake(tls_.get()); result <= 0) fail(result);
  }
  if (is_secure() && !waiting_.empty()) {
    SSL_write(tls_.get(), waiting_.data(), static_cast<int>(waiting_.size()));
    waiting_.clear();
  }
  flush();
}

bool PeerSocket::flush() {
  std::array<std::byte, 16 * 1024> out;
  bool is_good = true;
  for (int size = 0; is_good && (size = BIO_read(SSL_get_wbio(tls_.get()), out.data(), out.size())) > 0;)
    is_good = send_raw(std::span<const std::byte>(out).first(static_cast<std::size_t>(size)));
  return is_good;
}

void PeerSocket::fail(int result) {
  const int error = SSL_get_error(tls_.get(), result);
  if (error == SSL_ERROR_WANT_READ) return;
  is_ended_ = true;
  if (error != SSL_ERROR_SSL) return;
  const char* reason = ERR_reason_error_string(ERR_get_error());
  failure_ = reason ? reason : "TLS";
}

void PeerSocket::wait() {
  pollfd wanted{socket_.native_handle(), POLLIN, 0};
  if (!is_ended_) ::poll(&wanted, 1, static_cast<int>(brachy::test::kTurn.count()));
}

void PeerSocket::shutdown_tls() {
  SSL_shutdown(tls_.get());
  flush();
}

void PeerSocket::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
  is_ended_ = true;
}

}  // namespace brachy::net::test
