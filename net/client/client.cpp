#include "net/client/client.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <deque>
#include <utility>

#include "core/base/version.h"
#include "net/base/timeout_checks.h"
#include "net/transport/tcp/connect.h"
#include "net/transport/tcp/tcp_connection.h"
#include "net/transport/tls/tls_connection.h"
#include "net/wire/message_parser.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::size_t kFrameReadBytes = 128 * 1024;
constexpr int kSendBufferBytes = 64 * 1024;
constexpr std::size_t kMaxQueuedMessages = 64;  // pings, answers and state requests

}  // namespace

class Client::Impl final : public ConnectionListener, public std::enable_shared_from_this<Client::Impl> {
 public:
  Impl(asio::io_context& io, ClientOptions given, ClientHandlers handlers)
      : options_(std::move(given)),
        on_closed_(handlers.on_closed),
        messages_(wrap(std::move(handlers))),
        io_(io),
        clock_(*options_.clock),
        timer_(clock_.make_timer(io)),
        parser_(options_.max_message_bytes),
        needle_(options_.needle == kAnyNeedle ? std::uint16_t{0} : options_.needle) {}

  void connect(const std::string& host, std::uint16_t port) {
    asio::ip::tcp::socket socket = connect_tcp(io_, host, port, clock_, options_.connect_timeout);
    if (options_.tls)
      connection_ = TlsConnection::at_client(std::move(socket), clock_, *options_.tls, host, kSendBufferBytes,
                                             kFrameReadBytes);
    else
      connection_ =
          std::make_shared<TcpConnection>(std::move(socket), clock_, kSendBufferBytes, kFrameReadBytes);
    last_heard_ns_ = clock_.now_ns();
    connection_->start(shared_from_this());
    const auto flags = static_cast<std::uint16_t>(options_.evaluates_local_model ? kEvaluatesLocalModel : 0);
    send(HelloMessage{options_.role, options_.subscription, options_.limits, options_.name, options_.needle,
                      flags, options_.token, "brachy " + version(), options_.image_flags});
    on_timer();
  }

  template <WireMessage Message>
  void send(const Message& message) {
    Bytes body;
    encode_body(message, body);
    send_body(Message::kType, std::move(body));
  }

  void send_body(MessageType type, Bytes body) {
    if (!connection_) return;
    if (queue_.size() >= kMaxQueuedMessages) return end("the server does not read");
    queue_.push_back({type, clock_.now_ns(), std::move(body)});
    write_next();
  }

  void send_pose(const RigidTransform& X_WN, std::int64_t stamp_ns) {
    if (!connection_) return;
    if (poses_.size() >= options_.max_queued_poses) {
      const auto is_pose = [](const Outgoing& waiting) { return waiting.type == MessageType::kPose; };
      if (const auto oldest = std::ranges::find_if(poses_, is_pose); oldest != poses_.end()) {
        poses_.erase(oldest);
        ++poses_dropped_;
      }
    }
    Bytes body;
    encode_body(PoseMessage{needle_, 0, X_WN}, body);
    poses_.push_back({MessageType::kPose, stamp_ns, std::move(body)});
    write_next();
  }

  void press(std::uint16_t needle, bool pressed) {
    if (!connection_) return;
    if (poses_.size() >= options_.max_queued_poses + kMaxQueuedMessages)
      return end("the server does not read");
    Bytes body;
    encode_body(DropMessage{needle, pressed}, body);
    poses_.push_back({MessageType::kDrop, clock_.now_ns(), std::move(body)});
    write_next();
  }

  /// Ends the connection; `reason` empty: no call of on_closed.
  void end(const std::string& reason) {
    if (!connection_) return;
    connection_->close();
    connection_.reset();
    timer_->cancel();
    if (!reason.empty() && on_closed_) on_closed_(reason);
  }

  std::uint16_t needle() const { return needle_; }

 private:
  friend class Client;
  const ClientOptions options_;
  std::function<void(const std::string&)> on_closed_;
  ServerMessages messages_;
  ClockOffset offset_;
  std::shared_ptr<Connection> connection_;  // null before connect() and after the end
  std::uint64_t poses_sent_ = 0;
  std::uint64_t poses_dropped_ = 0;
  std::uint64_t bytes_received_ = 0;

  struct Outgoing {
    MessageType type;
    std::int64_t stamp_ns;
    Bytes body;
  };

  void on_bytes(std::span<const std::byte> bytes) override {
    bytes_received_ += bytes.size();
    last_heard_ns_ = clock_.now_ns();
    parser_.feed(bytes);
    MessageParser::Message message;
    while (connection_) {
      const DecodeResult result = parser_.next(message);
      if (result.is_bad()) return end("bad message from the server: " + std::string(result.reason));
      if (!result.is_good()) return;
      if (const auto why = take(message); !why.empty())
        return end("bad message from the server: " + std::string(why));
    }
  }

  void on_written() override {
    is_writing_ = false;
    write_next();
  }

  void on_closed(const std::string& reason) override {
    connection_.reset();
    timer_->cancel();
    if (on_closed_) on_closed_(fatal_.empty() ? reason : fatal_);
  }

  // Handles some messages before the user's handlers.
  MessageHandlers wrap(MessageHandlers handlers) {
    handlers.on_welcome = [this, own = std::move(handlers.on_welcome)](const WelcomeMessage& welcome) {
      if (welcome.needle != kAnyNeedle) needle_ = welcome.needle;
      if (own) own(welcome);
    };
    handlers.on_error = [this, own = std::move(handlers.on_error)](const ErrorMessage& error) {
      if (error.fatal) fatal_ = error.text;
      if (own) own(error);
    };
    return handlers;
  }

  std::string_view take(const MessageParser::Message& message) {
    if (message.header.type != MessageType::kPing) return messages_.take(message.header, message.body);
    PingMessage ping;
    const DecodeResult result = decode_body(message.body, ping);
    if (result.is_good()) handle_ping(ping, message.header);
    return result.reason;
  }

  void handle_ping(const PingMessage& ping, const Header& header) {
    if (!ping.reply) return send(PingMessage{ping.nonce, true, header.stamp_ns, last_heard_ns_});
    if (ping.nonce != ping_nonce_) return;
    offset_.add(ping.echoed_stamp_ns, ping.received_ns, header.stamp_ns, last_heard_ns_);
  }

  void on_timer() {
    const std::int64_t now = clock_.now_ns();
    if (checks_.as_of(now) && now - last_heard_ns_ >= in_ns(options_.silence_timeout))
      return end("the server stopped sending");
    if (connection_ && now - last_ping_ns_ >= in_ns(options_.ping_interval)) {
      last_ping_ns_ = now;
      send(PingMessage{++ping_nonce_, false, 0, 0});
    }
    if (!connection_) return;
    timer_->start(std::chrono::milliseconds(100), [self = shared_from_this()] {
      if (self->connection_) self->on_timer();
    });
  }

  void write_next() {
    if (is_writing_ || !connection_ || (queue_.empty() && poses_.empty())) return;
    auto& from = queue_.empty() ? poses_ : queue_;
    Outgoing next = std::move(from.front());
    from.pop_front();
    if (next.type == MessageType::kPose) ++poses_sent_;
    Bytes header;
    encode_header({kProtocolVersion, next.type, 0, static_cast<std::uint32_t>(next.body.size()),
                   ++sent_sequence_, next.stamp_ns},
                  header);
    is_writing_ = true;
    connection_->write(std::move(header), std::make_shared<const Bytes>(std::move(next.body)));
  }

  asio::io_context& io_;
  TimerClock& clock_;
  const std::unique_ptr<Timer> timer_;
  MessageParser parser_;
  std::uint16_t needle_;
  std::deque<Outgoing> queue_;
  std::deque<Outgoing> poses_;  // and button presses, in order
  bool is_writing_ = false;
  std::string fatal_;  // text of the fatal ERROR that came
  std::uint64_t sent_sequence_ = 0;
  std::uint64_t ping_nonce_ = 0;
  TimeoutChecks checks_;
  std::int64_t last_heard_ns_ = 0;
  std::int64_t last_ping_ns_ = 0;
};

Client::Client(asio::io_context& io, ClientOptions options, ClientHandlers handlers)
    : impl_(std::make_shared<Impl>(io, std::move(options), std::move(handlers))) {}

Client::~Client() {
  impl_->on_closed_ = {};
  impl_->end("");
}

void Client::connect(const std::string& host, std::uint16_t port) {
  impl_->connect(host, port);
}
void Client::send_pose(const RigidTransform& X_WN, std::int64_t stamp_ns) {
  impl_->send_pose(X_WN, stamp_ns);
}
void Client::arm(std::uint16_t needle) {
  impl_->send(ArmMessage{needle});
}
void Client::press(bool pressed) {
  impl_->press(impl_->needle(), pressed);
}
void Client::press(std::uint16_t needle, bool pressed) {
  impl_->press(needle, pressed);
}
void Client::control(const ControlMessage& message) {
  impl_->send(message);
}
std::uint16_t Client::needle() const {
  return impl_->needle();
}
void Client::request_state() {
  impl_->send_body(MessageType::kState, {});
}
void Client::send_body(MessageType type, Bytes body) {
  impl_->send_body(type, std::move(body));
}
void Client::close() {
  impl_->end("");
}
bool Client::is_open() const {
  return impl_->connection_ != nullptr;
}
const FrameAssembler& Client::mesh() const {
  return impl_->messages_.mesh();
}
std::uint64_t Client::poses_sent() const {
  return impl_->poses_sent_;
}
std::uint64_t Client::poses_dropped() const {
  return impl_->poses_dropped_;
}
std::uint64_t Client::frames() const {
  return impl_->messages_.frames();
}
std::uint64_t Client::snapshots_missed() const {
  return impl_->messages_.snapshots_missed();
}
std::uint64_t Client::bytes_received() const {
  return impl_->bytes_received_;
}
std::optional<ClockOffset::Sample> Client::clock_offset() const {
  return impl_->offset_.best();
}

}  // namespace brachy::net
