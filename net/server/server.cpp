#include "net/server/server.h"

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cassert>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "net/base/timeout_checks.h"
#include "net/session/acceptor.h"
#include "net/session/device_lease.h"
#include "net/session/frame_cache.h"
#include "net/session/notice_queue.h"
#include "net/session/pose_counts.h"
#include "net/session/session.h"
#include "net/transport/tcp/tcp_connection.h"
#include "net/transport/tls/tls_connection.h"
#include "net/wire/codec.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

constexpr std::size_t kReadBufferBytes = 16 * 1024;
constexpr std::uint64_t kOwnDevice = 0;  // session number of the daemon's own device
// EVENTs that a device came or left: a peer that connects and leaves over and over must not fill clients' queues.
constexpr double kDeviceNoticesPerS = 4, kDeviceNoticesBurst = 16;

void check(bool condition, const char* what) {
  if (!condition) throw UserError(std::string("server settings: ") + what);
}

ServerOptions checked(ServerOptions options) {
  check(options.needles >= 1 && options.needles <= 1024, "needles must be between 1 and 1024");
  check(options.max_clients >= 1, "max_clients must be at least 1");
  check(options.max_clients_per_address >= 1, "max_clients_per_address must be at least 1");
  check(options.max_poses_per_s >= 1, "max_poses_per_s must be at least 1");
  check(options.max_message_bytes >= 256 && options.max_message_bytes <= 64u << 20,
        "max_message_bytes must be between 256 and 67108864");
  check(options.max_queued_messages >= 4, "max_queued_messages must be at least 4");
  check(options.send_buffer_bytes >= 4096, "send_buffer_bytes must be at least 4096");
  check(options.ping_interval < options.silence_timeout,
        "ping_interval must be shorter than silence_timeout");
  return options;
}

/// What viewers of all points and of the surface alone see.
struct MeshTopologies {
  TopologyMessage volume, surface;
};

}  // namespace

class Server::Impl final : public SessionHost, public std::enable_shared_from_this<Server::Impl> {
 public:
  Impl(asio::io_context& io, ServerOptions given, const Tissue& tissue, const MeshTopologies& topologies,
       ServerHandlers handlers)
      : io_(io),
        options_(checked(std::move(given))),
        clock_(*options_.clock),
        handlers_(std::move(handlers)),
        topology_hash_(topologies.volume.hash),
        surface_hash_(topologies.surface.hash),
        topology_body_(encoded_body(topologies.volume)),
        surface_body_(encoded_body(topologies.surface)),
        frames_(make_layout(tissue, topologies.volume), make_layout(tissue, topologies.surface)),
        gate_(options_.max_clients, options_.max_clients_per_address, options_.tokens),
        handshakes_(std::make_shared<HandshakeTurns>(io, clock_, options_.handshake_thread)),
        acceptor_(std::make_shared<Acceptor>(io, clock_, listen_options(options_, options_.port, "--port"))),
        timer_(clock_.make_timer(io)),
        leases_(options_.needles, options_.probe_needle),
        requests_{options_.needles,
                  options_.probe_needle,
                  options_.max_poses_per_s,
                  options_.devices_at,
                  [this](std::uint16_t needle) { return is_own_device(needle); },
                  [this](std::uint16_t needle, const NeedlePose& pose) { return submit(needle, pose); },
                  [this](const PoseVerdict& verdict, std::uint16_t needle, const std::string& device) {
                    refuse_pose(verdict, needle, device);
                  },
                  [this] { broadcast_state(); }} {}

  void start() {
    acceptor_->start(
        gate_, Gate::Entry::kHello,
        [this](asio::ip::tcp::socket socket, auto slot) { on_socket(std::move(socket), std::move(slot)); },
        [this](const std::string& line) { log(line); });
    next_state_ns_ = clock_.now_ns();
    on_timer();
  }

  void adopt(std::shared_ptr<Connection> connection, std::shared_ptr<ConnectionSlot> slot) {
    if (is_stopped_) return connection->close();
    const auto refusal = slot->refusal() ? slot->refusal() : gate_.busy(*slot);
    const auto session = std::make_shared<Session>(++last_session_, std::move(connection), std::move(slot),
                                                   *this, requests_, options_);
    sessions_.emplace(session->id(), session);
    session->start();
    if (refusal) session->fail(refusal->code, refusal->text);
  }

  void publish(std::shared_ptr<const MeshState> state) {
    if (is_stopped_) return;
    const bool is_restarted = state->summary.run != frames_.run() || state->summary.tick < frames_.tick();
    frames_.update(std::move(state));
    if (is_restarted) {
      for (const auto& session : sessions()) session->forget_mesh();
    }
    for (const auto& session : sessions()) session->offer_snapshot();
  }

  void broadcast(MessageType type, const std::shared_ptr<const Bytes>& body) {
    for (const auto& session : sessions()) session->offer(type, body);
  }
  void broadcast(const EventMessage& event) {
    const auto body = encoded_body(event);
    for (const auto& session : sessions())
      session->offer(MessageType::kEvent, body, event.kind == EventKind::kSafety);
  }

  void publish(MessageType type, const std::shared_ptr<const Bytes>& body) {
    kept_[type] = body;
    for (const auto& session : sessions())
      if (session->wants(type)) session->offer(type, body);
  }

  ImageDemand image_demand() const {
    ImageDemand demand;
    demand.joined = image_subscribers_;
    for (const auto& [id, session] : sessions_) {
      if (!session->is_open() || !session->wants_images()) continue;
      demand.any = true;
      (session->takes_packed_images() ? demand.packed : demand.plain) = true;
    }
    return demand;
  }

  void publish_image(ScannerArray array, const std::shared_ptr<const Bytes>& plain,
                     const std::shared_ptr<const Bytes>& packed) {
    for (const auto& session : sessions())
      if (const auto& body = packed && session->takes_packed_images() ? packed : plain;
          body && session->wants_images())
        session->offer_image(array, body);
  }

  std::uint64_t images_dropped() const {
    std::uint64_t dropped = images_dropped_of_left_;
    for (const auto& [id, session] : sessions_)
      if (!session->is_closing()) dropped += session->images_dropped();
    return dropped;
  }

  void stop(const std::string& why) {
    if (is_stopped_) return;
    is_stopped_ = true;
    acceptor_->stop();
    for (const auto& session : sessions()) session->fail(ErrorCode::kShutdown, why);
    if (sessions_.empty()) timer_->cancel();
  }

  void end() {
    is_stopped_ = true;
    handlers_ = {};
    requests_.handlers = {};
    acceptor_->stop();
    for (const auto& session : sessions()) session->abort("the server is gone");
    timer_->cancel();
  }

  void set_scene(const SceneMessage& scene) { kept_[MessageType::kScene] = encoded_body(scene); }

  void broadcast_state() {
    if (sessions_.empty()) return;
    const StateMessage state = common_state();
    for (const auto& session : sessions()) session->send_state(state);
  }

  std::size_t client_count() const {
    return static_cast<std::size_t>(std::count_if(sessions_.begin(), sessions_.end(), [](const auto& entry) {
      return !entry.second->is_closing() && !entry.second->is_exempt();
    }));
  }

  RoleCounts role_counts() const {
    RoleCounts counts;
    counts.devices = attached_devices_.size();
    for (const auto& [id, session] : sessions_) {
      if (!session->is_open()) continue;
      const Role role = session->hello().role;
      ++(role == Role::kViewer ? counts.viewers : role == Role::kDevice ? counts.devices : counts.operators);
    }
    return counts;
  }

  StateMessage state() {
    StateMessage state = common_state();
    state.snapshots_dropped = dropped_of_left_;
    state.events_dropped = events_dropped_of_left_;
    for (const auto& [id, session] : sessions_) {
      if (session->is_closing()) continue;
      state.snapshots_dropped += session->snapshots_dropped();
      state.events_dropped += session->events_dropped();
    }
    return state;
  }

  // --- SessionHost ---

  std::optional<ErrorMessage> admit(Session& session, const HelloMessage& hello,
                                    WelcomeMessage& welcome) override {
    const bool is_view_only = !options_.devices_at.empty();
    const Role role = is_view_only && hello.role == Role::kOperator ? Role::kViewer : hello.role;
    if (!session.is_exempt())
      if (auto refusal = gate_.refusal(hello.token, role)) return refusal;
    if (auto busy = gate_.busy(session.slot())) return busy;
    if (is_view_only && role == Role::kDevice)
      return ErrorMessage{ErrorCode::kNotDevice, true, kRefusedNotDevice, 0,
                          "this server is view-only: devices connect to " + options_.devices_at};
    if (role == Role::kDevice) {
      const DeviceLease::Holder holder{session.id(), hello.name, session.address(), clock_.now_ns()};
      if (auto refusal = leases_.lend(holder, hello.needle, welcome.needle)) return refusal;
      send_attached(device_info(session, welcome.needle));
    }
    gate_.promote(session.slot());
    const std::string software = hello.software.empty() ? "" : " (" + hello.software + ")";
    if (!session.is_exempt())
      log("client " + std::to_string(session.id()) + " '" + hello.name + "'" + software + " from " +
          session.address() + " joined");
    welcome.session = session.id();
    welcome.role = role;
    welcome.subscription = hello.subscription;
    welcome.deformation_hz = options_.deformation_hz;
    welcome.snapshot_hz = options_.snapshot_hz;
    welcome.max_message_bytes = options_.max_message_bytes;
    welcome.max_poses_per_s = options_.max_poses_per_s;
    welcome.topology_hash = (hello.subscription & kSubscribeSurface) ? surface_hash_ : topology_hash_;
    welcome.server = options_.server_name;
    welcome.needle_count = options_.needles;
    if (role == Role::kDevice && handlers_.negotiated) welcome.limits = handlers_.negotiated(welcome.needle);
    return std::nullopt;
  }

  void on_open(Session& session) override {
    const bool is_surface = (session.hello().subscription & kSubscribeSurface) != 0;
    if (session.wants_mesh())
      session.send(MessageType::kTopology, is_surface ? surface_body_ : topology_body_);
    for (const MessageType type : {MessageType::kScene, MessageType::kPlan, MessageType::kScanner})
      send_kept(session, type);
    if (session.wants_images()) ++image_subscribers_;
    send_kept(session, MessageType::kDose);
    if (frames_.has_snapshot()) session.offer_snapshot();
  }
  void await_turn(Session& session) override {
    turns_.push_back(session.id());
    if (turns_.size() == 1) begin_turn();
  }
  std::pair<std::shared_ptr<const Bytes>, std::uint64_t> frame_body(const FrameRequest& request) override {
    return {frames_.body(request), frames_.tick()};
  }

  StateMessage common_state() override {
    StateMessage state = handlers_.state ? handlers_.state() : StateMessage{};
    poses_.add_to(state);
    state.snapshots = frames_.snapshots();
    for (const auto& [id, session] : sessions_) {
      if (!session->is_open() || session->is_exempt()) continue;
      ++state.clients;
      state.viewers += session->hello().role == Role::kViewer;
    }
    if (options_.devices_at.empty()) state.device_holder = leases_.holders();
    return state;
  }

  void on_ending(const Session& session, const std::string& reason) override {
    if (session.is_exempt()) return;
    const std::uint64_t dropped = session.snapshots_dropped();
    dropped_of_left_ += dropped;
    events_dropped_of_left_ += session.events_dropped();
    images_dropped_of_left_ += session.images_dropped();
    log("client " + std::to_string(session.id()) + " '" + session.name() + "' from " + session.address() +
        " left: " + reason + (dropped ? "; " + std::to_string(dropped) + " snapshots dropped" : ""));
    release_needle_of(session, reason);
  }

  // The first of `turns_` is taken off once it is through: until then none begins beside it.
  void begin_turn() {
    asio::post(io_, [self = shared_from_this()] {
      const auto found = self->sessions_.find(self->turns_.front());
      if (found != self->sessions_.end()) {
        const std::shared_ptr<Session> session = found->second;
        session->take_turn();
      }
      self->turns_.pop_front();
      if (!self->turns_.empty()) self->begin_turn();
    });
  }

  void on_closed(const Session& session) override {
    sessions_.erase(session.id());
    if (is_stopped_ && sessions_.empty()) timer_->cancel();
  }

  bool is_own_device(std::uint16_t needle) const {
    return needle < leases_.size() && leases_[needle].is_held_by(kOwnDevice);
  }
  PoseVerdict submit(std::uint16_t needle, const NeedlePose& pose) {
    PoseVerdict verdict = handlers_.on_pose ? handlers_.on_pose(needle, pose) : PoseVerdict{};
    verdict.accepted ? poses_.accept() : poses_.refuse(verdict.code, verdict.text);
    return verdict;
  }
  void refuse_pose(const PoseVerdict& verdict, std::uint16_t needle, const std::string& device) {
    poses_.refuse(verdict.code, verdict.text);
    note_stray_pose(needle, device, verdict.code == kRefusedRate ? StrayPose::kTooMany : StrayPose::kForeign);
  }
  void note_stray_pose(std::uint16_t needle, const std::string& device, StrayPose why) {
    if (handlers_.on_stray_pose) handlers_.on_stray_pose(needle, device, why);
  }

  std::optional<ErrorMessage> attach(const DeviceInfo& device) {
    std::uint16_t granted = 0;
    const DeviceLease::Holder holder{++last_session_, device.name, device.address, clock_.now_ns()};
    if (auto refusal = leases_.lend(holder, device.needle, granted)) return refusal;
    attached_devices_[granted] = {holder.session, device};
    send_attached(device);
    return std::nullopt;
  }
  void detach(std::uint16_t needle, const std::string& reason) {
    const auto attached = attached_devices_.find(needle);
    if (attached == attached_devices_.end()) return;
    auto [session, device] = attached->second;
    attached_devices_.erase(attached);
    device.reason = reason;
    release(session, device);
  }

  DeviceLease& lease(std::uint16_t needle) {
    assert(needle < leases_.size());
    return leases_[needle];
  }
  bool hold_lease(std::uint16_t needle, const std::string& name) {
    return lease(needle).take({kOwnDevice, name, "", clock_.now_ns()});
  }

  template <class M>
  bool send(std::uint16_t needle, const M& message) {
    const auto session = device_of(needle);
    if (!session) return false;
    const bool is_first = session->send_newest(M::kType, encoded_body(message));
    forces_replaced_ += is_first ? 0 : 1;
    return is_first;
  }

  std::optional<double> round_trip_s(std::uint16_t needle) const {
    const auto session = device_of(needle);
    const auto ns = session ? session->round_trip().median_ns() : std::nullopt;
    return ns ? std::optional(1e-9 * static_cast<double>(*ns)) : std::nullopt;
  }

 private:
  friend Server;
  /// A copy: sessions may end during an iteration.
  std::vector<std::shared_ptr<Session>> sessions() const {
    std::vector<std::shared_ptr<Session>> all;
    for (const auto& [id, session] : sessions_) all.push_back(session);
    return all;
  }

  void send_kept(Session& session, MessageType type) {
    if (const auto found = kept_.find(type); found != kept_.end() && session.wants(type))
      session.send(type, found->second);
  }

  /// Null: the needle has no network device.
  std::shared_ptr<Session> device_of(std::uint16_t needle) const {
    assert(needle < leases_.size());
    const auto found = sessions_.find(leases_[needle].session());
    return found == sessions_.end() || !found->second->is_open() ? nullptr : found->second;
  }

  void send_attached(const DeviceInfo& device) {
    if (handlers_.on_device) handlers_.on_device(true, device);
    notify({EventKind::kDeviceAttached, device.needle, frames_.tick(),
            "device " + leases_[device.needle].holder() + " attached" + leases_.of_needle(device.needle)});
  }

  /// A device's needle is released as soon as its session has failed, while the last ERROR is still being sent.
  void release_needle_of(const Session& session, const std::string& reason) {
    const std::uint16_t needle = session.needle();
    if (needle >= leases_.size() || !leases_[needle].is_held_by(session.id())) return;
    DeviceInfo info = device_info(session, needle);
    info.reason = reason;
    release(session.id(), info);
  }

  /// Ends the lease of a needle, which `session` holds.
  void release(std::uint64_t session, const DeviceInfo& device) {
    const std::string holder = leases_[device.needle].holder();
    leases_[device.needle].release(session);
    if (handlers_.on_device) handlers_.on_device(false, device);
    if (is_stopped_) return;
    notify({EventKind::kDeviceDetached, device.needle, frames_.tick(),
            "device " + holder + " left" + leases_.of_needle(device.needle) + ": " + device.reason});
  }

  void notify(EventMessage device_notice) {
    const std::string needle = std::to_string(device_notice.needle);
    device_notices_.add(needle, std::move(device_notice), clock_.now_ns());
  }

  static DeviceInfo device_info(const Session& session, std::uint16_t needle) {
    const HelloMessage& hello = session.hello();
    const bool is_evaluator = (hello.device_flags & kEvaluatesLocalModel) != 0;
    return {session.name(), session.address(), hello.limits, needle, is_evaluator, true, ""};
  }

  void on_socket(asio::ip::tcp::socket socket, std::shared_ptr<ConnectionSlot> slot) {
    const int buffer = options_.send_buffer_bytes;
    if (options_.tls) {
      auto connection = TlsConnection::at_server(std::move(socket), clock_, *options_.tls, handshakes_,
                                                 slot->origin(), buffer, kReadBufferBytes);
      adopt(std::move(connection), std::move(slot));
    } else {
      adopt(std::make_shared<TcpConnection>(std::move(socket), clock_, buffer, kReadBufferBytes),
            std::move(slot));
    }
  }

  void on_timer() {
    const std::int64_t now = clock_.now_ns();
    if (const auto time = checks_.as_of(now))
      for (const auto& session : sessions()) session->check_time(*time);
    device_notices_.update(now);
    if (now >= next_state_ns_ && !is_stopped_) {
      next_state_ns_ = now + in_ns(options_.state_interval);
      broadcast_state();
    }
    if (is_stopped_ && sessions_.empty()) return;
    timer_->start(TimeoutChecks::kPeriod, [self = shared_from_this()] { self->on_timer(); });
  }

  void log(const std::string& line) {
    if (handlers_.log) handlers_.log(line);
  }

  asio::io_context& io_;
  const ServerOptions options_;
  TimerClock& clock_;
  ServerHandlers handlers_;
  const std::uint64_t topology_hash_, surface_hash_;
  const std::shared_ptr<const Bytes> topology_body_, surface_body_;
  std::map<MessageType, std::shared_ptr<const Bytes>>
      kept_;  // SCENE, DOSE, PLAN, SCANNER, where there is one
  FrameCache frames_;
  Gate gate_;
  const std::shared_ptr<HandshakeTurns> handshakes_;
  const std::shared_ptr<Acceptor> acceptor_;
  const std::unique_ptr<Timer> timer_;
  std::map<std::uint64_t, std::shared_ptr<Session>> sessions_;
  std::uint64_t last_session_ = kOwnDevice;
  std::deque<std::uint64_t> turns_;  // sessions that wait to write what they were offered
  DeviceLeases leases_;
  RequestServer requests_;
  std::map<std::uint16_t, std::pair<std::uint64_t, DeviceInfo>>
      attached_devices_;  // of attach(), by needle: session number and device
  std::uint64_t forces_replaced_ = 0;
  std::uint64_t dropped_of_left_ = 0;  // snapshots, for sessions that ended
  std::uint64_t events_dropped_of_left_ = 0;
  std::uint64_t images_dropped_of_left_ = 0;
  std::uint64_t image_subscribers_ = 0;  // so far
  NoticeQueue device_notices_{
      kDeviceNoticesPerS, kDeviceNoticesBurst, [this](EventMessage event, std::uint64_t count) {
        if (count > 1) event.text += "; " + std::to_string(count - 1) + " notices before it left out";
        broadcast(event);
      }};
  PoseCounts poses_;
  std::int64_t next_state_ns_ = 0;
  TimeoutChecks checks_;
  bool is_stopped_ = false;
};

Server::Server(asio::io_context& io, ServerOptions options, const Tissue& tissue, ServerHandlers handlers) {
  const MeshTopologies topologies{make_topology(tissue, options.topology_name),
                                  make_topology(tissue, options.topology_name, true)};
  impl_ = std::make_shared<Impl>(io, std::move(options), tissue, topologies, std::move(handlers));
  impl_->start();
}

Server::~Server() {
  impl_->end();
}

std::uint16_t Server::port() const {
  return impl_->acceptor_->port();
}
const std::string& Server::address() const {
  return impl_->options_.address;
}
std::uint64_t Server::topology_hash() const {
  return impl_->topology_hash_;
}

const ServerOptions& Server::options() const {
  return impl_->options_;
}
RequestHandlers& Server::requests() {
  return impl_->requests_.handlers;
}
const RequestServer& Server::request_server() const {
  return impl_->requests_;
}
Gate& Server::gate() {
  return impl_->gate_;
}
const std::shared_ptr<HandshakeTurns>& Server::handshakes() const {
  return impl_->handshakes_;
}
void Server::adopt(std::shared_ptr<Connection> connection, std::shared_ptr<ConnectionSlot> slot) {
  impl_->adopt(std::move(connection), std::move(slot));
}

void Server::adopt_own(std::shared_ptr<Connection> connection) {
  impl_->adopt(std::move(connection), Gate::exempt_slot());
}

void Server::publish(std::shared_ptr<const MeshState> state) {
  asio::post(impl_->io_,
             [impl = impl_, state = std::move(state)]() mutable { impl->publish(std::move(state)); });
}

void Server::broadcast(MessageType type, const std::shared_ptr<const Bytes>& body) {
  impl_->broadcast(type, body);
}

void Server::broadcast(const EventMessage& event) {
  impl_->broadcast(event);
}

void Server::publish(MessageType type, const std::shared_ptr<const Bytes>& body) {
  impl_->publish(type, body);
}
ImageDemand Server::image_demand() const {
  return impl_->image_demand();
}
void Server::publish_image(ScannerArray array, const std::shared_ptr<const Bytes>& plain,
                           const std::shared_ptr<const Bytes>& packed) {
  impl_->publish_image(array, plain, packed);
}
std::uint64_t Server::images_dropped() const {
  return impl_->images_dropped();
}

void Server::set_scene(const SceneMessage& scene) {
  impl_->set_scene(scene);
}
void Server::broadcast_state() {
  impl_->broadcast_state();
}
bool Server::hold_lease(std::uint16_t needle, const std::string& name) {
  return impl_->hold_lease(needle, name);
}
void Server::release_lease(std::uint16_t needle) {
  impl_->lease(needle).release(kOwnDevice);
}
std::string Server::lease_holder(std::uint16_t needle) const {
  return impl_->lease(needle).holder();
}
std::optional<ErrorMessage> Server::attach(const DeviceInfo& device) {
  return impl_->attach(device);
}
void Server::detach(std::uint16_t needle, const std::string& reason) {
  impl_->detach(needle, reason);
}
PoseVerdict Server::submit(std::uint16_t needle, const NeedlePose& pose) {
  return impl_->submit(needle, pose);
}
void Server::refuse_pose(const PoseVerdict& verdict, std::uint16_t needle, const std::string& device) {
  impl_->refuse_pose(verdict, needle, device);
}
void Server::note_stray_pose(std::uint16_t needle, const std::string& device, StrayPose why) {
  impl_->note_stray_pose(needle, device, why);
}
bool Server::send(std::uint16_t needle, const ForceMessage& message) {
  return impl_->send(needle, message);
}
bool Server::send(std::uint16_t needle, const LocalModelMessage& message) {
  return impl_->send(needle, message);
}
std::uint64_t Server::forces_replaced() const {
  return impl_->forces_replaced_;
}
std::optional<double> Server::round_trip_s(std::uint16_t needle) const {
  return impl_->round_trip_s(needle);
}
std::size_t Server::client_count() const {
  return impl_->client_count();
}
Server::RoleCounts Server::role_counts() const {
  return impl_->role_counts();
}
StateMessage Server::state() const {
  return impl_->state();
}
void Server::stop(const std::string& why) {
  impl_->stop(why);
}

}  // namespace brachy::net
