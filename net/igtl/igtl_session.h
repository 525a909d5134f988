#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "net/base/rate_limit.h"
#include "net/igtl/codec/message_parser.h"
#include "net/igtl/content/commands.h"
#include "net/igtl/content/due_times.h"
#include "net/igtl/content/image_messages.h"
#include "net/igtl/content/snapshot_messages.h"
#include "net/igtl/content/tracking_feed.h"
#include "net/server/server.h"
#include "net/transport/connection.h"

namespace brachy::net::igtl {

/// One OpenIGTLink client, from the connection to its end. Of each kind of message at most one is being written and
/// one is pending: a flag, encoded from the newest snapshot when its turn comes. Answers wait in a short queue.
/// Threads: the io thread only.
class IgtlSession final : public ConnectionListener, public std::enable_shared_from_this<IgtlSession> {
 public:
  struct Environment {
    Server& server;
    SnapshotMessages& messages;
    ImageMessages& images;
    TrackingFeed& tracking;
    const RequestServer* commands;  ///< null: STRING and COMMAND are skipped
    std::chrono::milliseconds first_message_wait;
    std::function<void(const IgtlSession&, const std::string& reason)> on_closed;  ///< last call
    std::function<void()> on_dropped;  ///< a message of this client was dropped
    /// A TRANSFORM came whose name is no needle's.
    std::function<void(const IgtlSession&, const std::string& name)> on_other_name;
    std::function<void()> on_image_asked;  ///< this client is to get an image, also a frozen one
  };
  /// What a client gets: decided by its first message, or by who opened the connection.
  enum class Wish { kNotKnown, kStream, kAnswers };
  /// What was not taken or not sent, since the connection began.
  struct Losses {
    std::uint64_t skipped = 0;   ///< messages of types that are not read
    std::uint64_t ignored = 0;   ///< queries beyond the limits of their rate and number
    std::uint64_t replaced = 0;  ///< TDATA that a newer one overtook, because the client reads too slowly
    std::uint64_t missed = 0;    ///< TDATA for which no tick came in time
    std::string text() const;    ///< " (3 messages of other types skipped, …)"; empty where there were none
  };

  IgtlSession(std::uint64_t id, std::shared_ptr<Connection> connection, std::shared_ptr<ConnectionSlot> slot,
              const Environment& environment, Wish wish = Wish::kNotKnown);

  void start() { connection_->start(shared_from_this()); }
  /// There is a newer snapshot; `transforms`, `surface`: it is time to send these.
  void offer(bool transforms, bool surface);
  /// There is a newer image of this array.
  void offer_image(ScannerArray array);
  /// It asked for ultrasound images, and has not got them all.
  bool wants_images() const { return !is_closing() && (streams_images_ || asked_image_); }
  /// The tracking feed has a newer tick.
  void offer_tracking();
  /// Timeouts; to be called every 100 ms or so.
  void check_time(std::int64_t now_ns);
  /// Sends the STATUS, then ends within drain_timeout.
  void fail(const Status& status);
  /// Ends at once. `reason` is for the log.
  void abort(const std::string& reason);

  std::uint64_t id() const { return id_; }
  const std::string& address() const { return connection_->peer(); }
  bool is_closing() const { return phase_ != Phase::kOpen; }
  /// As its leases have it: "OpenIGTLink ADDRESS".
  std::string peer() const { return "OpenIGTLink " + address(); }
  /// A device of the client's, as its lease has it.
  std::string device_text(const std::string& device) const { return device + " (" + peer() + ")"; }
  Losses losses() const;
  /// The least time between two TDATA; nullopt: none are asked for.
  std::optional<double> tracking_period_s() const { return tracking_period_s_; }

 private:
  enum class Phase { kOpen, kClosing, kClosed };
  struct Held {
    std::uint16_t needle = 0;
    std::int64_t last_ns = 0;  // when its last TRANSFORM arrived
    std::int64_t pose_ns = 0,
                 stamp_ns = -1;  // when its last pose did, and that one's stamp; negative: none yet
  };

  void on_bytes(std::span<const std::byte> bytes) override;
  void on_written() override;
  void on_closed(const std::string& reason) override;

  void on_header(const Header& header);
  void handle(const MessageParser::Message& message);
  void handle_transform(const MessageParser::Message& message);
  void handle_query(const MessageParser::Message& message);
  void answer_transform(const Header& query);
  void answer_image(const Header& query);
  void answer_no_image(const std::string& why);
  void answer_points(const Header& query);
  void handle_text(const MessageParser::Message& message);
  Held* find_held(std::uint16_t needle);  ///< null: it does not hold this needle
  Held* attach(std::uint16_t needle, const std::string& device);
  void release_needles(const std::string& reason);
  std::int64_t stamp_of(const Header& header, const Held& held) const;
  void report(const Status& status, std::string_view about = {});
  void stop_tracking();
  void begin_stream();
  Label label(std::string_view device) const;
  void answer(Bytes message);
  void write_next();
  bool write_transforms();
  Bytes targets_once();
  void write(Bytes header, std::shared_ptr<const Bytes> body);

  const std::uint64_t id_;
  const std::shared_ptr<Connection> connection_;
  std::shared_ptr<ConnectionSlot> slot_;  // null once closed
  const Environment environment_;
  const ServerOptions& options_;
  Phase phase_ = Phase::kOpen;
  Wish wish_;
  MessageParser parser_;
  std::uint16_t version_ = 1;  // of headers sent: the highest received
  const std::int64_t opened_ns_;
  std::int64_t now_ns_;        // when the last bytes arrived
  std::int64_t begun_ns_ = 0;  // since when an incomplete message waits for its rest; 0: none does
  std::int64_t closing_ns_ = 0;
  std::string end_reason_;
  std::vector<Held> held_;
  std::uint64_t poses_received_ = 0;
  RateLimit poses_;
  RateLimit reports_{4, 4};  // STATUS that reports an error
  RateLimit queries_{50, 50};
  RateLimits requests_;  // that commands are
  Losses losses_;

  std::deque<Bytes> answers_;
  bool transforms_pending_ = false, surface_pending_ = false, tracking_pending_ = false,
       seeds_pending_ = false;
  bool is_surface_asked_ = false;  // STT_POLYDATA
  bool has_targets_sent_ = false;
  SnapshotMessages::SeedVersion seeds_sent_;
  bool streams_images_ = false;             // STT_IMAGE
  std::optional<std::string> asked_image_;  // the device that a GET_IMAGE named, which waits for its image
  std::int64_t asked_image_ns_ = 0;
  std::set<ScannerArray> images_pending_;
  ScannerArray last_image_{};
  bool was_image_ = false;    // written last: the others' turn
  bool was_surface_ = false;  // written last: the others' turn
  std::optional<double> tracking_period_s_;
  std::optional<DueTimes> tracking_due_;  // where there is a period
  bool writing_ = false;
};

}  // namespace brachy::net::igtl
