#include "net/session/session.h"

#include <algorithm>
#include <utility>

#include "net/wire/codec.h"

namespace brachy::net {
namespace {

constexpr std::chrono::milliseconds kMeasureInterval{
    100};  // between the PINGs that measure a device's round trip

/// A volume study within its own limits is longer than other messages, whatever max_message_bytes is.
constexpr std::uint32_t kMostContourBytes =
    1024 + ContourMessage::kMostSlices * (120 + 16 * ContourMessage::kMostPoints);

/// Whoever sent a wrong token waits this long for its refusal: this connection alone.
constexpr std::chrono::milliseconds kWrongTokenDelay{200};

std::string seconds(std::chrono::milliseconds duration) {
  const auto ms = duration.count();
  return ms % 1000 == 0 ? std::to_string(ms / 1000) + " s" : std::to_string(ms) + " ms";
}

}  // namespace

Session::Session(std::uint64_t id, std::shared_ptr<Connection> connection,
                 std::shared_ptr<ConnectionSlot> slot, SessionHost& host, const RequestServer& server,
                 const ServerOptions& options)
    : id_(id),
      connection_(std::move(connection)),
      slot_(std::move(slot)),
      is_own_(slot_->is_exempt()),
      host_(host),
      server_(server),
      options_(options),
      parser_(options.max_message_bytes),
      opened_ns_(options_.clock->now_ns()),
      last_message_ns_(opened_ns_) {}

void Session::start() {
  slot_->on_shed([weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->abort("said no HELLO, and newer connections needed its place");
  });
  connection_->start(shared_from_this());
}

// --- in ---

void Session::on_bytes(std::span<const std::byte> bytes) {
  if (is_closing() || late_refusal_)
    return;  // read and discard: closing with unread input would reset the connection before our ERROR arrives
  parser_.feed(bytes);
  MessageParser::Message message;
  while (!is_closing() && !late_refusal_) {
    const DecodeResult result = parser_.next(message);
    if (result.is_bad()) return fail(result.code, std::string(result.reason), parser_.last_sequence() + 1);
    if (!result.is_good()) return;
    last_message_ns_ = options_.clock->now_ns();
    handle(message);
  }
}

void Session::on_message(std::span<const std::byte> bytes) {
  Header header;
  const DecodeResult result = parser_.read_header(bytes, header);
  if (result.is_bad() || (result.is_good() && bytes.size() == kHeaderSize + header.length))
    return on_bytes(bytes);  // on_bytes reports what is bad
  if (!is_closing())
    fail(ErrorCode::kProtocol, "a WebSocket message must hold exactly one message",
         parser_.last_sequence() + 1);
}

template <class M>
bool Session::decode(const MessageParser::Message& message, M& decoded) {
  const DecodeResult result = decode_body(message.body, decoded);
  if (result.is_good()) return true;
  fail(result.code, std::string(result.reason), message.header.sequence);
  return false;
}

void Session::handle(const MessageParser::Message& message) {
  const MessageType type = message.header.type;
  if (phase_ == Phase::kHello) {
    if (type == MessageType::kHello) return handle_hello(message);
    return fail(ErrorCode::kProtocol, "the first message must be HELLO", message.header.sequence);
  }
  switch (type) {
    case MessageType::kHello:
      return fail(ErrorCode::kProtocol, "a second HELLO", message.header.sequence);
    case MessageType::kPing:
      return handle_ping(message);
    case MessageType::kState:
      return handle_state(message);
    case MessageType::kError: {
      ErrorMessage ignored;  // an error that a client reports changes nothing here
      decode(message, ignored);
      return;
    }
    default:
      break;
  }
  if (Request* const request = find_request(type)) {
    const auto refusal = request({message.header, message.body, last_message_ns_, sender_, rates_, server_});
    if (!refusal) return;
    refusal->fatal ? fail(refusal->code, refusal->text, refusal->about_sequence) : send_message(*refusal);
  } else if (only_servers_send(type)) {
    fail(ErrorCode::kProtocol, "only a server sends messages of this type", message.header.sequence);
  }
  // Any other type is of a later version: skipped.
}

void Session::handle_hello(const MessageParser::Message& message) {
  HelloMessage hello;
  if (!decode(message, hello)) return;
  constexpr std::uint32_t kGranted = kSubscribeFullFrames | kSubscribePoseHistory | kSubscribeSurface |
                                     kSubscribeNoMesh | kSubscribeScene | kSubscribePlan;
  hello.subscription &= options_.has_ultrasound ? kGranted | kSubscribeUltrasound : kGranted;
  hello_ = hello;
  hello_.token.reset();
  WelcomeMessage welcome;
  if (const auto refusal = host_.admit(*this, hello, welcome)) {
    if (refusal->code == ErrorCode::kUnauthorised && hello.token) {
      late_refusal_ = refusal;
      late_refusal_->about_sequence = message.header.sequence;
      return;
    }
    return fail(refusal->code, refusal->text, message.header.sequence);
  }
  phase_ = Phase::kOpen;
  if (welcome.role == Role::kOperator && kMostContourBytes > options_.max_message_bytes) {
    parser_.allow(MessageType::kContour, kMostContourBytes);
    connection_->allow_messages_of(kHeaderSize + kMostContourBytes);
  }
  send_message(welcome);
  if (hello_.role != welcome.role) {  // a view-only server grants the role viewer alone
    hello_.role = welcome.role;
    send_message(ErrorMessage{ErrorCode::kNotOperator, false, 0, message.header.sequence,
                              "this server is view-only: operators connect to " + options_.devices_at});
  }
  sender_ = {name() + " (" + address() + ")",
             welcome.role,
             welcome.needle,
             [weak = weak_from_this()](MessageType type, std::shared_ptr<const Bytes> body) {
               if (const auto self = weak.lock()) self->send(type, std::move(body));
             },
             [weak = weak_from_this()](const ErrorMessage& error) {
               if (const auto self = weak.lock()) self->send_message(error);
             },
             id_};
  host_.on_open(*this);
}

void Session::handle_ping(const MessageParser::Message& message) {
  PingMessage ping;
  if (!decode(message, ping)) return;
  if (ping.reply) return round_trip_.on_answer(ping.nonce, last_message_ns_);
  if (!rates_.pass({"PING", 50, 50}, last_message_ns_)) return;
  send_message(PingMessage{ping.nonce, true, message.header.stamp_ns, last_message_ns_});
}

void Session::handle_state(const MessageParser::Message& message) {
  if (!message.body.empty())
    return fail(ErrorCode::kProtocol, "a STATE from a client must be empty", message.header.sequence);
  if (rates_.pass({"STATE", 10, 2}, last_message_ns_)) send_state(host_.common_state());
}

// --- out ---

template <class M>
void Session::send_message(const M& message) {
  send(M::kType, encoded_body(message));
}

void Session::send(MessageType type, std::shared_ptr<const Bytes> body) {
  if (phase_ != Phase::kOpen) return;
  const auto own = std::count_if(queue_.begin(), queue_.end(), [](const Outgoing& o) { return o.is_own; });
  if (static_cast<std::size_t>(own) >= options_.max_queued_messages) {
    return fail(ErrorCode::kTimeout, kUnread);
  }
  queue_.push_back({type, std::move(body)});
  write_next();
}

void Session::offer(MessageType type, std::shared_ptr<const Bytes> body, bool is_safety) {
  if (phase_ != Phase::kOpen) return;
  if (type == MessageType::kEvent) {
    drop_excess_event();
  } else if (const auto waiting = std::find_if(queue_.begin(), queue_.end(),
                                               [&](const Outgoing& o) { return o.type == type; });
             waiting != queue_.end()) {
    waiting->body = std::move(body);
    return;
  }
  queue_.push_back({type, std::move(body), false, is_safety});
  write_next();
}

void Session::drop_excess_event() {
  const auto is_event = [](const Outgoing& o) { return o.type == MessageType::kEvent; };
  const auto waiting = std::count_if(queue_.begin(), queue_.end(), is_event);
  if (static_cast<std::size_t>(waiting) < options_.max_queued_messages) return;
  auto oldest = std::find_if(queue_.begin(), queue_.end(),
                             [&](const Outgoing& o) { return is_event(o) && !o.is_safety; });
  if (oldest == queue_.end()) oldest = std::find_if(queue_.begin(), queue_.end(), is_event);
  queue_.erase(oldest);
  ++events_dropped_;
}

void Session::send_state(const StateMessage& common) {
  const auto is_state = [](const Outgoing& outgoing) { return outgoing.type == MessageType::kState; };
  if (!is_open() || std::any_of(queue_.begin(), queue_.end(), is_state))
    return;  // one in the queue is enough
  StateMessage state = common;
  state.snapshots_sent = snapshots_sent_;
  state.snapshots_dropped = snapshots_dropped_;
  state.events_dropped = events_dropped_;
  send_message(state);
}

bool Session::wants(MessageType type) const {
  if (type == MessageType::kDose) return wants_mesh();
  if (type == MessageType::kScanner) return wants_scanner();
  return hello_.subscription & (type == MessageType::kScene ? kSubscribeScene : kSubscribePlan);
}

void Session::offer_snapshot() {
  if (!is_open() || !wants_mesh()) return;
  if (snapshot_pending_) ++snapshots_dropped_;
  snapshot_pending_ = true;
  await_turn();
}

void Session::offer_image(ScannerArray array, std::shared_ptr<const Bytes> body) {
  const auto index = static_cast<std::size_t>(array);
  if (!is_open() || !wants_images() || index >= kArrays) return;
  if (waiting_images_[index]) ++images_dropped_;
  waiting_images_[index] = std::move(body);
  await_turn();
}

void Session::await_turn() {
  if (!std::exchange(awaits_turn_, true)) host_.await_turn(*this);
}

void Session::take_turn() {
  awaits_turn_ = false;
  write_next();
}

bool Session::has_image() const {
  return std::ranges::any_of(waiting_images_, [](const auto& body) { return body != nullptr; });
}

/// Of several arrays' each in turn.
void Session::write_image() {
  while (!waiting_images_[next_image_]) next_image_ = (next_image_ + 1) % kArrays;
  auto body = std::exchange(waiting_images_[next_image_], nullptr);
  next_image_ = (next_image_ + 1) % kArrays;
  write(MessageType::kImage, std::move(body));
}

bool Session::send_newest(MessageType type, std::shared_ptr<const Bytes> body) {
  if (!is_open()) return false;
  auto& waiting = type == MessageType::kForce ? waiting_force_ : waiting_model_;
  const bool is_first = waiting == nullptr;
  waiting = std::move(body);
  write_next();
  return is_first;
}

/// False where no force waits, or where it must wait: for other messages, or because the peer has not read earlier
/// ones.
bool Session::write_newest() {
  if (!is_open() || (!waiting_force_ && !waiting_model_)) return false;
  const bool was_newest = last_written_ == MessageType::kForce || last_written_ == MessageType::kLocalModel;
  if (was_newest && (!queue_.empty() || snapshot_pending_ || has_image())) return false;
  if (connection_->unsent_bytes() > 0) return false;  // it would become outdated in the socket's buffer
  const bool is_force = waiting_force_ && (!waiting_model_ || last_written_ == MessageType::kLocalModel);
  if (is_force) {
    write(MessageType::kForce, std::exchange(waiting_force_, nullptr));
  } else {
    write(MessageType::kLocalModel, std::exchange(waiting_model_, nullptr));
  }
  return true;
}

void Session::write_next() {
  if (writing_ || phase_ == Phase::kClosed || write_newest()) return;
  if (!queue_.empty()) {
    const Outgoing next = std::move(queue_.front());
    queue_.pop_front();
    return write(next.type, next.body);
  }
  if (phase_ == Phase::kClosing) return connection_->shutdown_send();
  if (has_image() && !(snapshot_pending_ && last_written_ == MessageType::kImage)) return write_image();
  if (snapshot_pending_) write_frame();
}

void Session::write_frame() {
  const bool full = !sent_tick_ || (hello_.subscription & kSubscribeFullFrames);
  const bool history = hello_.subscription & kSubscribePoseHistory;
  const bool surface = hello_.subscription & kSubscribeSurface;
  const auto [body, tick] = host_.frame_body({sent_tick_.value_or(0), full, history, surface});
  snapshot_pending_ = false;
  sent_tick_ = tick;
  ++snapshots_sent_;
  write(MessageType::kFrame, body);
}

void Session::write(MessageType type, std::shared_ptr<const Bytes> body) {
  Bytes header;
  encode_header({kProtocolVersion, type, 0, static_cast<std::uint32_t>(body->size()), ++sent_sequence_,
                 options_.clock->now_ns()},
                header);
  writing_ = true;
  last_written_ = type;
  connection_->write(std::move(header), std::move(body));
}

void Session::on_written() {
  writing_ = false;
  write_next();
}

// --- time and end ---

void Session::check_time(std::int64_t now_ns) {
  switch (phase_) {
    case Phase::kHello:
      if (late_refusal_) {
        if (now_ns - last_message_ns_ >= in_ns(kWrongTokenDelay))
          fail(late_refusal_->code, late_refusal_->text, late_refusal_->about_sequence);
        return;
      }
      if (now_ns - opened_ns_ >= in_ns(options_.hello_timeout)) {
        fail(ErrorCode::kTimeout, "no HELLO within " + seconds(options_.hello_timeout));
      }
      return;
    case Phase::kOpen: {
      if (writing_ && now_ns - connection_->last_progress_ns() >= in_ns(options_.stall_timeout)) {
        return abort("did not read for " + seconds(options_.stall_timeout));
      }
      if (is_own_) return;  // no network in between
      const std::int64_t silence = now_ns - last_message_ns_;
      // A slow reader answers PINGs only after reading what was sent before them: it is alive as long as it reads.
      const bool reads_slowly = now_ns - connection_->last_waited_progress_ns() <
                                in_ns(options_.silence_timeout - options_.ping_interval);
      if (silence >= in_ns(options_.silence_timeout) && !reads_slowly) {
        return fail(ErrorCode::kTimeout, "sent nothing for " + seconds(options_.silence_timeout));
      }
      ping(now_ns);
      return write_next();  // for a force that had to wait for a slow reader
    }
    case Phase::kClosing:
      if (now_ns - closing_ns_ >= in_ns(options_.drain_timeout)) abort({});  // the reason was logged
      return;
    case Phase::kClosed:
      return;
  }
}

/// A device gets a PING every 100 ms, but one a second at most while an answer is outstanding; others only when silent.
void Session::ping(std::int64_t now_ns) {
  if (!queue_.empty()) return;
  const std::int64_t last_ns =
      hello_.role == Role::kDevice ? last_ping_ns_ : std::max(last_ping_ns_, last_message_ns_);
  const bool is_due = now_ns - last_ns >= in_ns(options_.ping_interval);
  const bool is_measured = hello_.role == Role::kDevice && !round_trip_.waiting_since_ns() &&
                           now_ns - last_ping_ns_ >= in_ns(kMeasureInterval);
  if (!is_due && !is_measured) return;
  last_ping_ns_ = now_ns;
  round_trip_.on_ping(++ping_nonce_, options_.clock->now_ns());
  send_message(PingMessage{ping_nonce_, false, 0, 0});
}

void Session::fail(ErrorCode code, const std::string& text, std::uint64_t about_sequence) {
  if (is_closing()) return;
  phase_ = Phase::kClosing;
  closing_ns_ = options_.clock->now_ns();
  queue_.clear();
  waiting_force_ = waiting_model_ = nullptr;
  waiting_images_.fill(nullptr);
  queue_.push_back({MessageType::kError, encoded_body(ErrorMessage{code, true, 0, about_sequence, text})});
  write_next();
  host_.on_ending(*this, text);
}

void Session::abort(const std::string& reason) {
  if (phase_ == Phase::kClosed) return;
  connection_->close();
  end(reason);
}

void Session::on_closed(const std::string& reason) {
  if (phase_ != Phase::kClosed) end(reason);
}

void Session::end(const std::string& reason) {
  const bool was_reported = phase_ == Phase::kClosing;
  phase_ = Phase::kClosed;
  slot_.reset();
  if (!was_reported) host_.on_ending(*this, reason);
  host_.on_closed(*this);
}

}  // namespace brachy::net
