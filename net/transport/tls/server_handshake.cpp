#include "net/transport/tls/server_handshake.h"

#include <openssl/err.h>

#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/write.hpp>
#include <span>
#include <utility>

#include "net/transport/tcp/tcp_socket.h"
#include "net/transport/tls/client_hello.h"
#include "net/transport/tls/tls_failure.h"
#include "net/wire/first_byte.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::size_t kReadBytes = 16 * 1024;  // a ClientHello at most

}  // namespace

/// OpenSSL's part, from bytes in memory to bytes in memory. Holds a reference to the stream's SSL, which the stream may
/// give up meanwhile. Threads: one at a time.
class ServerHandshake::Computation {
 public:
  enum class State { kWantsMore, kDone, kFailed };

  explicit Computation(SSL* tls) : tls_(tls), of_stream_(SSL_get_rbio(tls)) {
    SSL_up_ref(tls_);
    BIO_up_ref(of_stream_);
    SSL_set_bio(tls_, BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
    BIO_set_mem_eof_return(SSL_get_rbio(tls_), -1);
  }
  ~Computation() {
    BIO_free(of_stream_);
    SSL_free(tls_);
  }
  Computation(const Computation&) = delete;
  Computation& operator=(const Computation&) = delete;

  /// Takes `in`, goes on as far as it can, and fills `out`.
  void step() {
    BIO_write(SSL_get_rbio(tls_), in.data(), static_cast<int>(in.size()));
    ERR_clear_error();  // of this thread
    const int result = SSL_accept(tls_);
    const int kind = SSL_get_error(tls_, result);
    if (result == 1) {
      state = State::kDone;
    } else if (kind != SSL_ERROR_WANT_READ) {
      state = State::kFailed;
      error.assign(static_cast<int>(ERR_get_error()), asio::error::get_ssl_category());
    }
    out = all_of(SSL_get_wbio(tls_));
  }

  /// Returns the SSL to its stream; the bytes that came after the handshake.
  Bytes release() {
    Bytes rest = all_of(SSL_get_rbio(tls_));
    BIO_up_ref(of_stream_);
    SSL_set_bio(tls_, of_stream_, of_stream_);
    return rest;
  }

  const SSL* tls() const { return tls_; }

  Bytes in, out;
  State state = State::kWantsMore;
  boost::system::error_code error;  // of kFailed

 private:
  static Bytes all_of(BIO* memory) {
    Bytes bytes(BIO_ctrl_pending(memory));
    if (!bytes.empty()) BIO_read(memory, bytes.data(), static_cast<int>(bytes.size()));
    return bytes;
  }

  SSL* const tls_;
  BIO* const of_stream_;  // between SSL and Asio's stream, meanwhile replaced by memory
};

ServerHandshake::ServerHandshake(MeteredSocket socket, asio::ssl::context& context,
                                 std::shared_ptr<HandshakeTurns> turns, std::string origin)
    : context_(context),
      turns_(std::move(turns)),
      origin_(std::move(origin)),
      plain_(std::move(socket)),
      read_(kReadBytes) {}

ServerHandshake::~ServerHandshake() {
  turns_->forget(ticket_);
}

void ServerHandshake::start(Done done) {
  done_ = std::move(done);
  read();
}

void ServerHandshake::close() {
  const auto self = shared_from_this();  // done_ may own the owner of this
  const Done dropped = std::exchange(done_, nullptr);
  turns_->forget(ticket_);
  boost::system::error_code ignored;
  socket().socket.close(ignored);
}

void ServerHandshake::read() {
  socket().async_read_some(asio::buffer(read_) + size_, [self = shared_from_this()](
                                                            const boost::system::error_code& error,
                                                            std::size_t size) {
    if (!self->done_) return;
    if (error && self->computation_)
      return self->end(Outcome::kFailed, failure_with_client(error, self->computation_->tls()));
    if (error)
      return self->end(Outcome::kLeft, error == asio::error::eof ? "closed by the peer" : error.message());
    self->size_ += size;
    self->on_bytes();
  });
}

void ServerHandshake::on_bytes() {
  if (computation_) return compute(HandshakeTurns::Step::kLater);
  // Checked before OpenSSL, whose answer a client without TLS could not read.
  if (read_[0] != std::byte{kFirstByteOfTls}) return end(Outcome::kPlain);
  switch (find_client_hello(std::span<const std::byte>(read_).first(size_), read_.size())) {
    case ClientHello::kIncomplete:
      return read();
    case ClientHello::kBad:
      return end(Outcome::kFailed, "TLS: it began with no ClientHello");
    case ClientHello::kComplete:
      ticket_ = turns_->wait(origin_, [weak = weak_from_this()] {
        const auto self = weak.lock();
        return self && self->done_ && self->begin();
      });
  }
}

bool ServerHandshake::begin() {
  if (has_left(socket().socket)) {
    // Not from here: the owner closes it, and it may be the one that adds it.
    asio::post(socket().get_executor(), [self = shared_from_this()] {
      if (self->done_) self->end(Outcome::kLeft, "closed by the peer");
    });
    return false;
  }
  stream_.emplace(std::move(*plain_), context_);
  plain_.reset();
  computation_ = std::make_shared<Computation>(stream_->handle());
  compute(HandshakeTurns::Step::kFirst);
  return true;
}

void ServerHandshake::compute(HandshakeTurns::Step which) {
  computation_->in.assign(read_.begin(), read_.begin() + static_cast<std::ptrdiff_t>(size_));
  size_ = 0;
  turns_->compute(
      which, [computation = computation_] { computation->step(); },
      [weak = weak_from_this()] {
        const auto self = weak.lock();
        if (self && self->done_) self->on_computed();
      });
}

void ServerHandshake::on_computed() {
  asio::async_write(socket(), asio::buffer(computation_->out),
                    [self = shared_from_this()](const boost::system::error_code&, std::size_t) {
                      if (!self->done_) return;
                      Computation& computation = *self->computation_;
                      switch (computation.state) {
                        case Computation::State::kWantsMore:
                          return self->read();  // which reports also that the peer has left
                        case Computation::State::kFailed:
                          return self->end(Outcome::kFailed,
                                           failure_with_client(computation.error, computation.tls()));
                        case Computation::State::kDone:
                          self->socket().unread = computation.release();
                          return self->end(Outcome::kOpen);
                      }
                    });
}

void ServerHandshake::end(Outcome outcome, const std::string& why) {
  const Done done = std::exchange(done_, nullptr);
  done(outcome, why);
}

}  // namespace brachy::net
