#include "net/igtl/igtl_server.h"

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "net/base/timeout_checks.h"
#include "net/igtl/igtl_session.h"
#include "net/server/server.h"
#include "net/session/acceptor.h"
#include "net/transport/tcp/tcp_connection.h"

namespace brachy::net::igtl {
namespace asio = boost::asio;
namespace {

constexpr std::size_t kReadBufferBytes = 16 * 1024;
constexpr std::size_t kMaxLoggedNames = 32;  // of TRANSFORMs that are no needle's

/// The server's, but loopback where anybody else might reach it.
std::string checked_address(const IgtlOptions& options, const ServerOptions& common) {
  if (!common.tokens.is_empty() && !options.without_token)
    throw UserError(
        "OpenIGTLink has no tokens: any program that reaches its port could steer the needle; leave the "
        "port out "
        "(--igtl-port, server.igtl_port), or set server.igtl_without_token = true");
  return common.allow_remote || is_loopback(common.address) ? common.address : "127.0.0.1";
}

/// The protocol has neither tokens nor TLS.
void check_target(const LinkTarget& target, const ServerOptions& common) {
  if (common.allow_remote || target.host == "localhost" || is_loopback(target.host)) return;
  throw UserError(
      "server.igtl_connect = \"" + target.text() +
      "\": OpenIGTLink has neither tokens nor TLS, and the machine is another; name one on loopback, such "
      "as an ssh tunnel's end, or give --insecure-allow-remote");
}

}  // namespace

class IgtlServer::Impl : public std::enable_shared_from_this<IgtlServer::Impl> {
 public:
  Impl(asio::io_context& io, const IgtlOptions& options, Server& server, const Tissue& tissue, Log log)
      : io_(io),
        options_(options),
        server_(server),
        clock_(*server.options().clock),
        log_(std::move(log)),
        messages_(tissue, server.options().topology_name, options.naming, options.targets),
        images_(options.naming),
        address_(options.listens ? checked_address(options, server.options()) : std::string()),
        acceptor_(options.listens ? std::make_shared<Acceptor>(
                                        io, clock_,
                                        ListenOptions{address_, options.port, server.options().allow_remote,
                                                      false, false, "--igtl-port"})
                                  : nullptr),
        timer_(clock_.make_timer(io)) {
    if (options.connect) check_target(*options.connect, server.options());
    restart_rates();
  }

  void start() {
    if (acceptor_)
      acceptor_->start(
          server_.gate(), Gate::Entry::kImmediate,
          [this](asio::ip::tcp::socket socket, auto slot) { on_socket(std::move(socket), std::move(slot)); },
          [this](const std::string& line) { log_(line); });
    if (options_.connect) {
      link_ = std::make_shared<TcpLink>(
          io_, clock_, *options_.connect,
          TcpLink::Handlers{[this](asio::ip::tcp::socket socket) { on_linked(std::move(socket)); },
                            [this](const std::string& line) { log_("OpenIGTLink: " + line); }});
      link_->start();
    }
    on_timer();
  }

  bool wants_ticks() const {
    const double snapshot_s = 1 / server_.options().snapshot_hz;
    return std::ranges::any_of(sessions_, [&](const auto& entry) {
      const auto period_s = entry.second->tracking_period_s();
      return period_s && *period_s < snapshot_s;
    });
  }

  void track(TrackedTick tick, std::int64_t utc_ns) {
    if (is_stopped_ || !tracking_.update(std::move(tick), utc_ns)) return;
    for (const auto& session : sessions()) session->offer_tracking();
  }

  IgtlSession::Losses losses() const {
    IgtlSession::Losses all = losses_;
    for (const auto& [id, session] : sessions_) add(all, session->losses());
    return all;
  }
  bool is_link_up() const { return linked_ != 0; }

  void publish(std::shared_ptr<const MeshState> state) {
    if (is_stopped_) return;
    const MeshState* last = messages_.state();
    if (last && state->summary.tick < last->summary.tick) restart_rates();
    // Of the simulation's time, so that a snapshot that came late does not cost the next one.
    const auto time_ns = static_cast<std::int64_t>(1e9 * state->summary.sim_time_s);
    const std::int64_t age_ns =
        state->summary.publish_ns != 0 ? clock_.now_ns() - state->summary.publish_ns : 0;
    const std::int64_t when_ns = clock_.utc_ns() - age_ns;
    TrackedTick tick = TrackedTick::of(*state);
    messages_.update(std::move(state), when_ns);
    const bool transforms = transform_rate_.pass(time_ns), surface = surface_rate_.pass(time_ns);
    for (const auto& session : sessions()) session->offer(transforms, surface);
    track(std::move(tick), when_ns);
  }

  void publish_image(std::shared_ptr<const ImageMessage> image) {
    if (is_stopped_) return;
    const ScannerArray array = image->array;
    const std::int64_t age_ns = image->publish_ns != 0 ? clock_.now_ns() - image->publish_ns : 0;
    images_.update(std::move(image), clock_.utc_ns() - age_ns);
    for (const auto& session : sessions()) session->offer_image(array);
  }
  bool wants_images() const {
    return std::ranges::any_of(sessions_, [](const auto& entry) { return entry.second->wants_images(); });
  }

  void set_scanner(const ScannerMessage& scanner) { images_.set_scanner(scanner); }
  std::uint64_t images_asked() const { return images_asked_; }

  void stop(const std::string& why) {
    if (is_stopped_) return;
    is_stopped_ = true;
    stop_connecting();
    for (const auto& session : sessions())
      session->fail(
          {StatusCode::kShutdown, static_cast<std::uint16_t>(ErrorCode::kShutdown), "Shutdown", why});
    if (sessions_.empty()) timer_->cancel();
  }

  void end() {
    is_stopped_ = true;
    stop_connecting();
    for (const auto& session : sessions()) session->abort("the server is gone");
    timer_->cancel();
  }

  std::size_t client_count() const {
    return static_cast<std::size_t>(std::count_if(
        sessions_.begin(), sessions_.end(), [](const auto& entry) { return !entry.second->is_closing(); }));
  }
  const std::string& address() const { return address_; }
  std::uint16_t port() const { return acceptor_ ? acceptor_->port() : std::uint16_t{0}; }
  std::uint64_t surfaces_encoded() const { return messages_.encoded(); }
  std::uint64_t messages_dropped() const { return messages_dropped_; }
  std::uint64_t other_names() const { return other_names_; }
  asio::io_context& io() { return io_; }

 private:
  /// A copy: sessions may end while it is walked.
  std::vector<std::shared_ptr<IgtlSession>> sessions() const {
    std::vector<std::shared_ptr<IgtlSession>> all;
    for (const auto& [id, session] : sessions_) all.push_back(session);
    return all;
  }

  /// The burst makes up for snapshots that come unevenly; the mean stays within the rate.
  void restart_rates() {
    transform_rate_ = RateLimit(options_.transform_hz, 1.5);
    surface_rate_ = RateLimit(options_.surface_hz, 1.5);
  }

  void stop_connecting() {
    if (acceptor_) acceptor_->stop();
    if (link_) link_->stop();
  }

  static void add(IgtlSession::Losses& all, const IgtlSession::Losses& some) {
    all.skipped += some.skipped;
    all.ignored += some.ignored;
    all.replaced += some.replaced;
    all.missed += some.missed;
  }

  std::shared_ptr<IgtlSession> add_session(asio::ip::tcp::socket socket, std::shared_ptr<ConnectionSlot> slot,
                                           IgtlSession::Wish wish) {
    auto connection = std::make_shared<TcpConnection>(std::move(socket), clock_,
                                                      server_.options().send_buffer_bytes, kReadBufferBytes);
    IgtlSession::Environment environment{
        server_,
        messages_,
        images_,
        tracking_,
        options_.takes_commands ? &server_.request_server() : nullptr,
        options_.first_message_wait,
        [this](const IgtlSession& session, const std::string& reason) { on_closed(session, reason); },
        [this] { ++messages_dropped_; },
        [this](const IgtlSession& session, const std::string& name) { on_other_name(session, name); },
        [this] { ++images_asked_; }};
    auto session = std::make_shared<IgtlSession>(++last_session_, std::move(connection), std::move(slot),
                                                 environment, wish);
    sessions_.emplace(session->id(), session);
    return session;
  }

  void on_socket(asio::ip::tcp::socket socket, std::shared_ptr<ConnectionSlot> slot) {
    const auto refusal = slot->refusal();
    const auto session = add_session(std::move(socket), std::move(slot), IgtlSession::Wish::kNotKnown);
    log_("OpenIGTLink client from " + session->address() + " joined");
    session->start();
    if (refusal)
      session->fail({StatusCode::kBusy, static_cast<std::uint16_t>(refusal->code), "Busy", refusal->text});
  }

  /// A server that we connected to: a session without a slot, since nobody came.
  void on_linked(asio::ip::tcp::socket socket) {
    const auto session =
        add_session(std::move(socket), nullptr,
                    options_.connect_sends ? IgtlSession::Wish::kStream : IgtlSession::Wish::kAnswers);
    linked_ = session->id();
    log_("OpenIGTLink: connected to " + link_->target().text());
    session->start();
  }

  void on_closed(const IgtlSession& session, const std::string& reason) {
    const bool is_link = session.id() == linked_;
    log_((is_link ? "OpenIGTLink: the connection to " + link_->target().text() + " ended: "
                  : "OpenIGTLink client from " + session.address() + " left: ") +
         reason);
    add(losses_, session.losses());
    sessions_.erase(session.id());
    foreign_named_.erase(session.id());
    if (is_link) {
      linked_ = 0;
      link_->on_ended();
    }
    if (is_stopped_ && sessions_.empty()) timer_->cancel();
  }

  /// Counts all, logs each name once while there are few.
  void on_other_name(const IgtlSession& session, const std::string& name) {
    ++other_names_;
    if (foreign_named_.insert(session.id()).second)
      server_.note_stray_pose(0, session.device_text(name), StrayPose::kForeign);
    if (logged_names_.size() >= kMaxLoggedNames || !logged_names_.insert(name).second) return;
    log_("OpenIGTLink client from " + session.address() + ": TRANSFORM " + name +
         " moves no needle and is skipped; a needle's is named NeedleToRas, of several Needle0ToRas, "
         "Needle1ToRas, …");
  }

  void on_timer() {
    if (const auto time = checks_.as_of(clock_.now_ns()))
      for (const auto& session : sessions()) session->check_time(*time);
    if (is_stopped_ && sessions_.empty()) return;
    timer_->start(TimeoutChecks::kPeriod, [self = shared_from_this()] { self->on_timer(); });
  }

  asio::io_context& io_;
  const IgtlOptions options_;
  Server& server_;
  TimerClock& clock_;
  const Log log_;
  SnapshotMessages messages_;
  ImageMessages images_;
  TrackingFeed tracking_;
  const std::string address_;                 // empty: does not listen
  const std::shared_ptr<Acceptor> acceptor_;  // null likewise
  std::shared_ptr<TcpLink> link_;             // null: connects to nobody
  std::uint64_t linked_ = 0;                  // its session; 0: not connected
  const std::unique_ptr<Timer> timer_;
  TimeoutChecks checks_;
  RateLimit transform_rate_{1, 1}, surface_rate_{1, 1};
  std::map<std::uint64_t, std::shared_ptr<IgtlSession>> sessions_;
  std::uint64_t last_session_ = 0;
  std::uint64_t messages_dropped_ = 0, other_names_ = 0, images_asked_ = 0;
  IgtlSession::Losses losses_;  // of sessions that have ended
  std::set<std::string> logged_names_;
  std::set<std::uint64_t> foreign_named_;  // sessions whose first other name the server has been told
  bool is_stopped_ = false;
};

IgtlServer::IgtlServer(asio::io_context& io, const IgtlOptions& options, Server& server, const Tissue& tissue,
                       Log log)
    : impl_(std::make_shared<Impl>(io, options, server, tissue, std::move(log))) {
  impl_->start();
}

IgtlServer::~IgtlServer() {
  impl_->end();
}

const std::string& IgtlServer::address() const {
  return impl_->address();
}
std::uint16_t IgtlServer::port() const {
  return impl_->port();
}

void IgtlServer::publish(std::shared_ptr<const MeshState> state) {
  asio::post(impl_->io(),
             [impl = impl_, state = std::move(state)]() mutable { impl->publish(std::move(state)); });
}

void IgtlServer::publish_image(std::shared_ptr<const ImageMessage> image) {
  impl_->publish_image(std::move(image));
}
bool IgtlServer::wants_images() const {
  return impl_->wants_images();
}

void IgtlServer::set_scanner(const ScannerMessage& scanner) {
  impl_->set_scanner(scanner);
}
std::uint64_t IgtlServer::images_asked() const {
  return impl_->images_asked();
}
std::size_t IgtlServer::client_count() const {
  return impl_->client_count();
}
std::uint64_t IgtlServer::surfaces_encoded() const {
  return impl_->surfaces_encoded();
}
bool IgtlServer::wants_ticks() const {
  return impl_->wants_ticks();
}
void IgtlServer::track(TrackedTick tick, std::int64_t utc_ns) {
  impl_->track(std::move(tick), utc_ns);
}
IgtlSession::Losses IgtlServer::losses() const {
  return impl_->losses();
}
bool IgtlServer::is_link_up() const {
  return impl_->is_link_up();
}
std::uint64_t IgtlServer::other_names() const {
  return impl_->other_names();
}
std::uint64_t IgtlServer::messages_dropped() const {
  return impl_->messages_dropped();
}
void IgtlServer::stop(const std::string& why) {
  impl_->stop(why);
}

}  // namespace brachy::net::igtl
