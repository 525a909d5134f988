#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "net/access/gate.h"
#include "net/requests/request.h"
#include "net/session/round_trip.h"
#include "net/session/server_options.h"
#include "net/transport/connection.h"
#include "net/wire/frame_encoder.h"
#include "net/wire/message_parser.h"

namespace brachy::net {

class Session;

/// The server as seen by a session. Called on the io thread.
class SessionHost {
 public:
  virtual ~SessionHost() = default;
  /// Admits the client, or returns the reason why not. Only `hello` has its token. On admission fills in the WELCOME.
  virtual std::optional<ErrorMessage> admit(Session& session, const HelloMessage& hello,
                                            WelcomeMessage& welcome) = 0;
  /// The client has been welcomed: sends it what it subscribed to and is there already.
  virtual void on_open(Session& session) = 0;
  /// Calls take_turn() soon, in a turn of the io thread by itself: what all sessions are offered at once takes each
  /// some tenths of a millisecond to write, and forces go between them.
  virtual void await_turn(Session& session) = 0;
  /// The newest snapshot as asked for, and the tick it holds.
  virtual std::pair<std::shared_ptr<const Bytes>, std::uint64_t> frame_body(const FrameRequest& request) = 0;
  virtual StateMessage common_state() = 0;
  /// The session ends; once, before on_closed(). If it failed, a last ERROR is still being sent, and nothing else any
  /// more.
  virtual void on_ending(const Session& session, const std::string& reason) = 0;
  /// Last call; the session is not used afterwards.
  virtual void on_closed(const Session& session) = 0;
};

/// One client, from connection to end: handshake, requests in; frames, states and pings out. Knows messages and time,
/// but no socket and no other session. Holds at most one frame being written; the pending one is only a flag, encoded
/// from the newest snapshot when its turn comes. Forces have priority, but take only every other message while
/// anything else waits. Threads: the io thread only.
class Session final : public ConnectionListener, public std::enable_shared_from_this<Session> {
 public:
  Session(std::uint64_t id, std::shared_ptr<Connection> connection, std::shared_ptr<ConnectionSlot> slot,
          SessionHost& host, const RequestServer& server, const ServerOptions& options);

  void start();
  /// Queues an answer to this client. One that leaves more than max_queued_messages answers unread is closed.
  void send(MessageType type, std::shared_ptr<const Bytes> body);
  /// Queues what others caused, and never ends the session: a message replaces one of its type that still waits. Of
  /// EVENTs at most max_queued_messages wait; beyond that the oldest is dropped and counted, one of kind safety last.
  void offer(MessageType type, std::shared_ptr<const Bytes> body, bool is_safety = false);
  /// Sends a FORCE or LOCAL_MODEL as soon as nothing written before waits for the peer. Replaces one of the same type
  /// that has not been sent, and returns false then.
  bool send_newest(MessageType type, std::shared_ptr<const Bytes> body);
  /// Announces a newer snapshot: one still pending is dropped and counted.
  void offer_snapshot();
  /// The newest IMAGE of an array: one of it that still waits is dropped and counted.
  void offer_image(ScannerArray array, std::shared_ptr<const Bytes> body);
  /// Writes what was offered, as SessionHost::await_turn() says.
  void take_turn();
  /// The simulation was reset: the client's mesh is outdated, and the next FRAME is full.
  void forget_mesh() { sent_tick_.reset(); }
  void send_state(const StateMessage& common);
  /// Checks timeouts and sends PINGs; called as TimeoutChecks schedules it.
  void check_time(std::int64_t now_ns);
  /// Sends a fatal ERROR, then ends within drain_timeout.
  void fail(ErrorCode code, const std::string& text, std::uint64_t about_sequence = 0);
  /// Ends at once. `reason` is for the log.
  void abort(const std::string& reason);

  std::uint64_t id() const { return id_; }
  const std::string& name() const { return hello_.name; }
  const std::string& address() const { return connection_->peer(); }  ///< with its port
  ConnectionSlot& slot() { return *slot_; }                           ///< not once closed
  bool is_exempt() const { return is_own_; }                          ///< the in-process viewer
  bool is_closing() const { return phase_ == Phase::kClosing || phase_ == Phase::kClosed; }
  bool is_open() const { return phase_ == Phase::kOpen; }
  const HelloMessage& hello() const { return hello_; }  ///< once open; without its token
  bool wants_mesh() const { return (hello_.subscription & kSubscribeNoMesh) == 0; }
  bool wants(MessageType type) const;  ///< SCENE, PLAN, SCANNER or DOSE
  bool wants_scanner() const { return (hello_.subscription & kSubscribeUltrasound) != 0; }
  bool wants_images() const { return wants_scanner() && (hello_.image_flags & kScannerOnly) == 0; }
  bool takes_packed_images() const { return (hello_.image_flags & kTakesZlib) != 0; }
  std::uint16_t needle() const { return sender_.needle; }  ///< granted; kAnyNeedle: none
  std::uint64_t snapshots_dropped() const { return snapshots_dropped_; }
  std::uint64_t images_dropped() const { return images_dropped_; }
  std::uint64_t events_dropped() const { return events_dropped_; }
  const RoundTrip& round_trip() const { return round_trip_; }

 private:
  enum class Phase { kHello, kOpen, kClosing, kClosed };
  struct Outgoing {
    MessageType type;
    std::shared_ptr<const Bytes> body;
    bool is_own = true;      // an answer to this client, or its STATE
    bool is_safety = false;  // an EVENT of that kind
  };

  void on_bytes(std::span<const std::byte> bytes) override;
  void on_message(std::span<const std::byte> bytes) override;
  void on_written() override;
  void on_closed(const std::string& reason) override;

  void handle(const MessageParser::Message& message);
  void handle_hello(const MessageParser::Message& message);
  void handle_ping(const MessageParser::Message& message);
  void handle_state(const MessageParser::Message& message);
  void ping(std::int64_t now_ns);
  bool write_newest();
  template <class M>
  bool decode(const MessageParser::Message& message, M& decoded);
  template <class M>
  void send_message(const M& message);
  void end(const std::string& reason);
  void drop_excess_event();
  bool has_image() const;
  void write_image();
  void write_frame();
  void await_turn();
  void write_next();
  void write(MessageType type, std::shared_ptr<const Bytes> body);

  const std::uint64_t id_;
  const std::shared_ptr<Connection> connection_;
  std::shared_ptr<ConnectionSlot> slot_;  // null once closed
  const bool is_own_;
  SessionHost& host_;
  const RequestServer& server_;
  const ServerOptions& options_;
  Phase phase_ = Phase::kHello;
  MessageParser parser_;
  HelloMessage hello_;
  std::int64_t opened_ns_;
  std::int64_t last_message_ns_;
  std::int64_t last_ping_ns_ = 0;
  std::int64_t closing_ns_ = 0;
  std::optional<ErrorMessage> late_refusal_;  // of a wrong token, sent a moment later
  Sender sender_;                             // this client, once open
  RateLimits rates_;                          // of its requests
  RoundTrip round_trip_;                      // of a device
  std::deque<Outgoing> queue_;
  std::shared_ptr<const Bytes> waiting_force_, waiting_model_;        // null: none
  static constexpr std::size_t kArrays = 4;                           // ScannerArray of an image
  std::array<std::shared_ptr<const Bytes>, kArrays> waiting_images_;  // null: none
  std::size_t next_image_ = 0;                                        // whose turn it is
  MessageType last_written_{};
  bool writing_ = false;
  bool awaits_turn_ = false;
  bool snapshot_pending_ = false;
  std::optional<std::uint64_t> sent_tick_;  // of the last frame written
  std::uint64_t sent_sequence_ = 0;
  std::uint64_t snapshots_sent_ = 0;
  std::uint64_t snapshots_dropped_ = 0;
  std::uint64_t images_dropped_ = 0;
  std::uint64_t events_dropped_ = 0;
  std::uint64_t ping_nonce_ = 0;
};

}  // namespace brachy::net
