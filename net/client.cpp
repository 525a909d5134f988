#include "net/client.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <deque>
#include <utility>

#include "net/clock.h"
#include "net/tcp/connect.h"
#include "net/tcp/tcp_connection.h"
#include "net/wire/message_parser.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::size_t kReadBufferBytes = 128 * 1024;
constexpr int kSendBufferBytes = 64 * 1024;
constexpr std::size_t kMaxQueuedMessages = 64;  // pings, answers and state requests

template <class Handler, class... Args>
void call(const Handler& handler, const Args&... args) {
  if (handler) handler(args...);
}

}  // namespace

class Client::Impl final : public ConnectionListener, public std::enable_shared_from_this<Client::Impl> {
 public:
  Impl(asio::io_context& io, ClientOptions given, ClientHandlers handlers)
      : options_(std::move(given)),
        handlers_(std::move(handlers)),
        io_(io),
        timer_(io),
        parser_(options_.max_message_bytes),
        needle_(options_.needle == kAnyNeedle ? std::uint16_t{0} : options_.needle) {}

  void connect(const std::string& host, std::uint16_t port) {
    connection_ = std::make_shared<TcpConnection>(connect_tcp(io_, host, port, options_.connect_timeout),
                                                  kSendBufferBytes, kReadBufferBytes);
    last_heard_ns_ = monotonic_ns();
    connection_->start(shared_from_this());
    const auto flags = static_cast<std::uint16_t>(options_.evaluates_local_model ? kEvaluatesLocalModel : 0);
    send(HelloMessage{options_.role, options_.subscription, options_.limits, options_.name, options_.needle,
                      flags});
    keep_house();
  }

  template <class M>
  void send(const M& message) {
    Bytes body;
    encode_body(message, body);
    send_body(M::kType, std::move(body));
  }

  void send_body(MessageType type, Bytes body) {
    if (!connection_) return;
    if (queue_.size() >= kMaxQueuedMessages) return end("the server does not read");
    queue_.push_back({type, monotonic_ns(), std::move(body)});
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

  void press(bool pressed) {
    if (!connection_) return;
    if (poses_.size() >= options_.max_queued_poses + kMaxQueuedMessages)
      return end("the server does not read");
    Bytes body;
    encode_body(DropMessage{needle_, pressed}, body);
    poses_.push_back({MessageType::kDrop, monotonic_ns(), std::move(body)});
    write_next();
  }

  /// Ends the connection; `reason` empty = nobody is told.
  void end(const std::string& reason) {
    if (!connection_) return;
    connection_->close();
    connection_.reset();
    timer_.cancel();
    if (!reason.empty()) call(handlers_.on_closed, reason);
  }

  void forget_handlers() { handlers_ = {}; }

  std::uint16_t needle() const { return needle_; }

  const ClientOptions options_;
  ClientHandlers handlers_;
  FrameAssembler mesh_;
  ClockOffset clock_;
  std::shared_ptr<Connection> connection_;  // null before connect() and after the end
  std::uint64_t poses_sent_ = 0;
  std::uint64_t poses_dropped_ = 0;
  std::uint64_t frames_ = 0;
  std::uint64_t snapshots_missed_ = 0;
  std::uint64_t bytes_received_ = 0;

 private:
  struct Outgoing {
    MessageType type;
    std::int64_t stamp_ns;
    Bytes body;
  };

  void on_bytes(std::span<const std::byte> bytes) override {
    bytes_received_ += bytes.size();
    last_heard_ns_ = monotonic_ns();
    parser_.feed(bytes);
    MessageParser::Message message;
    while (connection_) {
      const DecodeResult result = parser_.next(message);
      if (result.is_bad()) return end("bad message from the server: " + std::string(result.reason));
      if (!result.is_good()) return;
      handle(message);
    }
  }

  void on_written() override {
    is_writing_ = false;
    write_next();
  }

  void on_closed(const std::string& reason) override {
    connection_.reset();
    timer_.cancel();
    call(handlers_.on_closed, fatal_.empty() ? reason : fatal_);
  }

  template <class M, class Handle>
  void decode(const MessageParser::Message& message, M& decoded, const Handle& handle_decoded) {
    const DecodeResult result = decode_body(message.body, decoded);
    if (!result.is_good()) return end("bad message from the server: " + std::string(result.reason));
    handle_decoded();
  }

  void handle(const MessageParser::Message& message) {
    switch (message.header.type) {
      case MessageType::kWelcome: {
        WelcomeMessage welcome;
        return decode(message, welcome, [&] {
          if (welcome.needle != kAnyNeedle) needle_ = welcome.needle;
          call(handlers_.on_welcome, welcome);
        });
      }
      case MessageType::kTopology: {
        TopologyMessage topology;
        return decode(message, topology, [&] {
          if (const auto why = mesh_.start(topology); !why.empty()) return end(std::string(why));
          call(handlers_.on_topology, topology);
        });
      }
      case MessageType::kFrame:
        return decode(message, frame_, [&] { handle_frame(); });
      case MessageType::kState: {
        StateMessage state;
        return decode(message, state, [&] { call(handlers_.on_state, state); });
      }
      case MessageType::kEvent: {
        EventMessage event;
        return decode(message, event, [&] { call(handlers_.on_event, event); });
      }
      case MessageType::kError: {
        ErrorMessage error;
        return decode(message, error, [&] {
          if (error.fatal) fatal_ = error.text;
          call(handlers_.on_error, error);
        });
      }
      case MessageType::kPing: {
        PingMessage ping;
        return decode(message, ping, [&] { handle_ping(ping, message.header); });
      }
      case MessageType::kForce: {
        ForceMessage force;
        return decode(message, force, [&] { call(handlers_.on_force, force); });
      }
      case MessageType::kLocalModel: {
        LocalModelMessage model;
        return decode(message, model, [&] { call(handlers_.on_local_model, model); });
      }
      case MessageType::kDose: {
        DoseMessage dose;
        return decode(message, dose, [&] { call(handlers_.on_dose, dose); });
      }
      case MessageType::kHello:
      case MessageType::kPose:
      case MessageType::kArm:
      case MessageType::kDrop:
        return end("bad message from the server: only a client sends messages of this type");
    }
  }

  void handle_frame() {
    if (const auto why = mesh_.apply(frame_); !why.empty()) return end(std::string(why));
    if (frames_ > 0 && frame_.snapshot_sequence > last_snapshot_) {
      snapshots_missed_ += frame_.snapshot_sequence - last_snapshot_ - 1;
    }
    last_snapshot_ = frame_.snapshot_sequence;
    ++frames_;
    call(handlers_.on_frame, frame_);
  }

  void handle_ping(const PingMessage& ping, const Header& header) {
    if (!ping.reply) return send(PingMessage{ping.nonce, true, header.stamp_ns, last_heard_ns_});
    if (ping.nonce != ping_nonce_) return;
    clock_.add(ping.echoed_stamp_ns, ping.received_ns, header.stamp_ns, last_heard_ns_);
  }

  void keep_house() {
    const std::int64_t now = monotonic_ns();
    if (now - last_heard_ns_ >= in_ns(options_.silence_timeout))
      return end("the server says nothing any more");
    if (connection_ && now - last_ping_ns_ >= in_ns(options_.ping_interval)) {
      last_ping_ns_ = now;
      send(PingMessage{++ping_nonce_, false, 0, 0});
    }
    if (!connection_) return;
    timer_.expires_after(std::chrono::milliseconds(100));
    timer_.async_wait([self = shared_from_this()](const boost::system::error_code& error) {
      if (!error && self->connection_) self->keep_house();
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
  asio::steady_timer timer_;
  MessageParser parser_;
  FrameMessage frame_;
  std::uint16_t needle_;
  std::deque<Outgoing> queue_;
  std::deque<Outgoing> poses_;  // and button presses among them
  bool is_writing_ = false;
  std::string fatal_;  // text of the fatal ERROR that came
  std::uint64_t sent_sequence_ = 0;
  std::uint64_t last_snapshot_ = 0;
  std::uint64_t ping_nonce_ = 0;
  std::int64_t last_heard_ns_ = 0;
  std::int64_t last_ping_ns_ = 0;
};

Client::Client(asio::io_context& io, ClientOptions options, ClientHandlers handlers)
    : impl_(std::make_shared<Impl>(io, std::move(options), std::move(handlers))) {}

Client::~Client() {
  impl_->forget_handlers();
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
  impl_->press(pressed);
}
std::uint16_t Client::needle() const {
  return impl_->needle();
}
void Client::request_state() {
  impl_->send_body(MessageType::kState, {});
}
void Client::close() {
  impl_->end("");
}
bool Client::is_open() const {
  return impl_->connection_ != nullptr;
}
const FrameAssembler& Client::mesh() const {
  return impl_->mesh_;
}
std::uint64_t Client::poses_sent() const {
  return impl_->poses_sent_;
}
std::uint64_t Client::poses_dropped() const {
  return impl_->poses_dropped_;
}
std::uint64_t Client::frames() const {
  return impl_->frames_;
}
std::uint64_t Client::snapshots_missed() const {
  return impl_->snapshots_missed_;
}
std::uint64_t Client::bytes_received() const {
  return impl_->bytes_received_;
}
std::optional<ClockOffset::Sample> Client::clock_offset() const {
  return impl_->clock_.best();
}

}  // namespace brachy::net
