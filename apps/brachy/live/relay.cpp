#include <fmt/format.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <cmath>
#include <csignal>
#include <deque>
#include <exception>
#include <fstream>
#include <future>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "apps/command_line/option_groups.h"
#include "apps/command_line/tool.h"
#include "apps/command_line/viewer_files.h"
#include "core/base/error.h"
#include "core/realtime/deadline.h"
#include "net/access/token_file.h"
#include "net/broker/arrival_offset.h"
#include "net/broker/relayed_mesh.h"
#include "net/broker/session_feed.h"
#include "net/client/server_messages.h"
#include "net/http/http_listener.h"
#include "net/server/server.h"

namespace brachy {
namespace {

/// Serves a session that a daemon publishes to a broker.
struct RelayOptions {
  std::string broker;  ///< URL
  std::string session = "default";
  std::filesystem::path broker_ca, broker_certificate, broker_key;  ///< TLS towards the broker; empty: none
  std::string address = "127.0.0.1";
  int port = 18950;
  std::optional<int> http_port;                     ///< none: no page, no WebSocket
  std::optional<std::filesystem::path> token_file;  ///< viewers send it; none: they need no token
  std::filesystem::path tls_certificate, tls_key;   ///< for viewers; empty: unencrypted
  int max_clients = 1024, max_clients_per_address = 1024;
  bool insecure_allow_remote = false;
  std::optional<double> duration_s;  ///< none: until SIGINT or SIGTERM
  bool json = false;
};

namespace asio = boost::asio;

constexpr std::uint16_t kMaxNeedles = 1024;  // as a Server takes

net::BrokerOptions broker_options(const RelayOptions& options) {
  net::BrokerOptions o;
  o.url = options.broker;
  o.session = options.session;
  o.tls_ca = options.broker_ca.string();
  o.tls_certificate = options.broker_certificate.string();
  o.tls_key = options.broker_key.string();
  o.client_name = "brachy relay";
  net::check_broker_options(o, "--nats");
  return o;
}

net::ServerOptions server_options(const RelayOptions& options) {
  using enum net::Role;
  net::ServerOptions o;
  o.address = options.address;
  o.port = static_cast<std::uint16_t>(options.port);
  o.allow_remote = options.insecure_allow_remote;
  if (options.token_file) o.tokens.add(net::load_token(*options.token_file), {kViewer});
  if (!options.tls_certificate.empty())
    o.tls = net::make_server_context(
        {options.tls_certificate, options.tls_key, {}},
        [](const std::string& line) { std::cerr << "brachy relay: " << line << "\n"; });
  o.max_clients = static_cast<std::uint32_t>(options.max_clients);
  o.max_clients_per_address = static_cast<std::uint32_t>(options.max_clients_per_address);
  o.devices_at = "the daemon itself; this is a relay of its session '" + options.session + "'";
  return o;
}

/// Serves a daemon's published session to viewers. The caller's is the io thread, where messages are
/// decoded and viewers served; the feed's waits for the broker and hands it one message after the other.
/// With TLS a third computes handshakes.
class Relay {
 public:
  explicit Relay(const RelayOptions& options)
      : options_(options), broker_(broker_options(options)), server_options_(server_options(options)) {
    if (!server_options_.tls) return;
    handshakes_.emplace(1);
    server_options_.handshake_thread = [this](std::function<void()> step) {
      asio::post(*handshakes_, std::move(step));
    };
  }

  int run() {
    signals_.async_wait([this](const auto& error, int) {
      if (!error) end();
    });
    if (options_.duration_s) {
      duration_.expires_after(std::chrono::nanoseconds(std::llround(*options_.duration_s * 1e9)));
      duration_.async_wait([this](const auto& error) {
        if (!error) end();
      });
    }
    say("waiting for session " + options_.session + " at " + net::shown_url(broker_));
    feed_ = std::jthread([this](const std::stop_token& stop) {
      net::run_session_feed(stop, broker_, feed_handlers(), monotonic_clock());
      asio::post(io_, [this] { work_.reset(); });  // the feed no longer waits for the io thread
    });
    for (bool is_over = false; !is_over;) {
      try {
        io_.run();
        is_over = true;
      } catch (...) {
        failure_ = std::current_exception();
        end();  // the feed may wait for this thread
      }
    }
    feed_.join();
    if (failure_) std::rethrow_exception(failure_);
    report();
    return kExitOk;
  }

 private:
  /// The server for viewers of one daemon.
  struct Stage {
    Stage(asio::io_context& io, const net::TopologyMessage& topology, const net::ServerOptions& options,
          net::ServerHandlers handlers)
        : mesh(topology, options.needles), server(io, options, mesh.tissue(), std::move(handlers)) {}
    net::RelayedMesh mesh;
    net::Server server;
    std::optional<net::HttpListener> http;
  };

  // --- on the feed's thread ---

  net::FeedHandlers feed_handlers() {
    net::FeedHandlers h;
    h.on_message = [this](const net::ChunkAssembler::Message& message) {
      std::promise<bool> taken;  // the feed blocks meanwhile; further messages stay in libnats' buffer
      auto answer = taken.get_future();
      asio::post(io_,
                 [this, &message, taken = std::move(taken)]() mutable { taken.set_value(take(message)); });
      return answer.get();
    };
    h.on_broker = [this](bool is_connected, const std::string& why) {
      asio::post(io_, [this, is_connected, why] { on_broker(is_connected, why); });
    };
    h.on_asked = [this] { asio::post(io_, [this] { on_asked(); }); };
    return h;
  }

  // --- on the io thread ---

  /// False: the message is not valid here.
  bool take(const net::ChunkAssembler::Message& message) {
    if (is_ending_) return true;
    try {
      const std::string_view why = refusal_of(message);
      if (!why.empty()) say("invalid message: " + std::string(why));
      return why.empty();
    } catch (...) {  // a port in use, out of memory
      failure_ = std::current_exception();
      end();
      return true;
    }
  }

  std::string_view refusal_of(const net::ChunkAssembler::Message& message) {
    if (publisher_ != message.chunk.publisher) switch_publisher(message.chunk.publisher);
    arrivals_.add(message.header.stamp_ns, monotonic_ns());
    ++messages_taken_;
    heard_ns_ = monotonic_ns();
    bytes_ += net::kHeaderSize + message.body.size();
    if (message.header.type == net::MessageType::kDose) {  // sent again whenever a relay requests the state
      if (std::ranges::equal(dose_body_, message.body)) return {};
      dose_body_.assign(message.body.begin(), message.body.end());
    }
    refusal_ = {};
    const std::string_view why = messages_.take(message.header, message.body);
    return why.empty() ? refusal_ : why;
  }

  /// Another daemon, or the same one restarted: viewers reconnect, as they would have to at the daemon.
  void switch_publisher(std::uint64_t publisher) {
    publisher_ = publisher;
    ++daemons_;
    arrivals_ = {};
    messages_ = net::ServerMessages(message_handlers());
    welcome_.reset();
    topology_.reset();
    scene_.reset();
    plan_.reset();
    dose_.reset();
    dose_body_.clear();
    if (!stage_) return;
    say("another daemon publishes the session");
    replaced_ = std::move(stage_);  // its viewers see the last picture until there is another
  }

  net::MessageHandlers message_handlers() {
    net::MessageHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      if (welcome.needle_count == 0 || welcome.needle_count > kMaxNeedles)
        refusal_ = "an invalid number of needles";
      else
        welcome_ = welcome;
    };
    h.on_topology = [this](const net::TopologyMessage& topology) {
      if (topology_ && topology_->hash != topology.hash)
        refusal_ = "the daemon's tissue has changed";
      else if (!topology_)
        topology_ = topology;
    };
    h.on_scene = [this](const net::SceneMessage& scene) { scene_ = scene; };
    h.on_dose = [this](const net::DoseMessage& dose) {
      dose_ = dose;
      if (stage_) stage_->server.publish(dose);
    };
    h.on_plan = [this](const net::PlanMessage& plan) {
      plan_ = plan;
      if (stage_) stage_->server.publish(plan);
    };
    h.on_state = [this](const net::StateMessage& state) { state_ = state; };
    h.on_event = [this](const net::EventMessage& event) {
      if (stage_) stage_->server.broadcast(event);
    };
    h.on_error = [this](const net::ErrorMessage& error) {
      notify(net::EventKind::kWarning, "the daemon: " + error.text);
    };
    h.on_frame = [this](const net::FrameMessage& frame) {
      if (!welcome_ || !topology_) {
        refusal_ = "a frame came before welcome and topology";
        return;
      }
      if (!stage_) open();
      if (!stage_->mesh.fits(frame)) {
        refusal_ = "a frame of another tissue";
        return;
      }
      stage_->mesh.take(frame, arrivals_.offset_ns());
      ++frames_;
      stage_->server.publish(std::make_shared<const MeshState>(stage_->mesh.state()));
      if (std::exchange(is_missed_, false)) notify(net::EventKind::kNote, "the daemon is back");
    };
    return h;
  }

  /// Frees the port at once, so that reconnecting viewers find the new simulation there. The old ones' viewers get the
  /// reason within the drain timeout; where daemons come faster, the oldest viewers are closed without.
  void retire_replaced() {
    constexpr std::size_t kMostRetired = 2;
    stop(*replaced_);
    retired_.push_back(std::move(replaced_));
    if (retired_.size() > kMostRetired) retired_.pop_front();
    retire_timer_.expires_after(2 * server_options_.drain_timeout);
    retire_timer_.async_wait([this](const auto& error) {
      if (!error) retired_.clear();
    });
  }

  void open() {
    if (replaced_) retire_replaced();
    net::ServerOptions o = server_options_;
    o.needles = welcome_->needle_count;
    o.deformation_hz = welcome_->deformation_hz;
    o.snapshot_hz = welcome_->snapshot_hz;
    o.server_name = welcome_->server + ", relayed";
    o.topology_name = topology_->name;
    net::ServerHandlers handlers;
    handlers.state = [this] {
      net::StateMessage state = state_;
      state.clients = state.viewers = 0;  // the server counts those that are here
      return state;
    };
    stage_ = std::make_unique<Stage>(io_, *topology_, o, std::move(handlers));
    net::Server& server = stage_->server;
    const bool is_first = !std::exchange(was_opened_, true);
    server_options_.port = server.port();  // the next daemon's viewers find it there, too
    if (options_.http_port) {
      net::HttpOptions http;
      http.port = http_port_.value_or(static_cast<std::uint16_t>(*options_.http_port));
      http.pages = pages();
      net::ServedFiles files = viewer_files();
      if (!files.has_viewer()) say("the viewer is not built: browsers get a page with the instructions");
      stage_->http.emplace(io_, server, std::move(http), std::move(files), [](const std::string&) {});
      http_port_ = stage_->http->port();
    }
    if (scene_) server.set_scene(*scene_);
    if (plan_) server.publish(*plan_);
    if (dose_) server.publish(*dose_);
    if (!is_first) return;
    std::cout << "brachy relay listening on " << server.address() << ":" << server.port() << std::endl;
    if (http_port_)
      std::cout << (o.tls ? "https on " : "http on ") << server.address() << ":" << *http_port_ << std::endl;
  }

  net::DynamicPages pages() {
    net::DynamicPages pages;
    pages["/healthz"] = {net::DynamicPage::Access::kAnyone, [this] {
                           const std::string failure = this->failure();
                           return net::DynamicPage::Content{failure.empty() ? 200 : 503,
                                                            "text/plain; charset=utf-8",
                                                            (failure.empty() ? "ok" : failure) + "\n"};
                         }};
    pages["/metrics"] = {
        net::DynamicPage::Access::kViewer, [this] {
          return net::DynamicPage::Content{200, "text/plain; version=0.0.4; charset=utf-8", metrics()};
        }};
    return pages;
  }

  /// Why viewers do not see what the daemon does now; "": they do.
  std::string failure() const {
    // A daemon with nothing new still sends its STATE twice a second.
    constexpr std::int64_t kSilenceNs = 5'000'000'000;
    if (!is_connected_) return "no connection to the broker";
    if (monotonic_ns() - heard_ns_ >= kSilenceNs) return "the daemon has sent nothing for 5 s";
    return {};
  }

  std::string metrics() const {
    std::string text;
    const auto add = [&](const char* name, const char* type, const char* help, double value) {
      text += fmt::format("# HELP {0} {1}\n# TYPE {0} {2}\n{0} {3}\n", name, help, type, value);
    };
    const auto count = [&](const char* name, const char* help, std::uint64_t value) {
      add(name, "counter", help, static_cast<double>(value));
    };
    double total_pages = 0, resident_pages = 0;
    std::ifstream("/proc/self/statm") >> total_pages >> resident_pages;
    add("brachy_relay_viewers", "gauge", "Connected viewers.",
        static_cast<double>(stage_ ? stage_->server.client_count() : 0));
    add("brachy_relay_simulations", "gauge",
        "Simulations in memory: of the daemon, and of those before it whose viewers are being closed.",
        static_cast<double>(retired_.size() + (stage_ ? 1 : 0) + (replaced_ ? 1 : 0)));
    count("brachy_relay_messages_total", "Messages of daemons.", messages_taken_);
    count("brachy_relay_bytes_total", "Bytes of them.", bytes_);
    count("brachy_relay_frames_total", "Snapshots among them.", frames_);
    count("brachy_relay_asked_total", "Times the full state was requested, because messages were missing.",
          asked_);
    count("brachy_relay_connections_total", "Connections to the broker.", connections_);
    count("brachy_relay_daemons_total", "Daemons that have published the session, restarted ones too.",
          daemons_);
    add("process_resident_memory_bytes", "gauge", "Resident memory.",
        resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)));
    return text;
  }

  void on_broker(bool is_connected, const std::string& why) {
    is_connected_ = is_connected;
    say((is_connected ? "connected to " : "no connection to ") + net::shown_url(broker_) +
        (why.empty() ? "" : ": ") + why);
    connections_ += is_connected;
    if (!is_connected && stage_ && !std::exchange(is_missed_, true))
      notify(net::EventKind::kWarning, "no connection to the broker: the picture is frozen until it is back");
  }

  void on_asked() {
    ++asked_;
    if (stage_ && !std::exchange(is_missed_, true))
      notify(net::EventKind::kWarning,
             "messages of the daemon are missing: the picture is frozen until they arrive");
  }

  /// Sends an event to all viewers and logs it.
  void notify(net::EventKind kind, const std::string& what) {
    if (!stage_) return;
    say(what);
    stage_->server.broadcast({kind, 0, stage_->mesh.state().summary.tick, "relay: " + what});
  }

  static void stop(Stage& stage) {
    stage.server.stop();
    if (stage.http) stage.http->stop();
  }

  void end() {
    if (std::exchange(is_ending_, true)) return;
    signals_.cancel();
    duration_.cancel();
    retire_timer_.cancel();
    feed_.request_stop();
    if (stage_) stop(*stage_);
    if (replaced_) stop(*replaced_);
  }

  void report() const {
    if (options_.json) {
      std::cout << nlohmann::ordered_json{{"messages", messages_taken_}, {"bytes", bytes_},
                                          {"frames", frames_},           {"asked", asked_},
                                          {"connections", connections_}, {"daemons", daemons_}}
                       .dump()
                << std::endl;
      return;
    }
    std::cerr << fmt::format(
        "relay: {} messages, {:.1f} MB, {} of them frames; connected {} times, full state requested {} "
        "times\n",
        messages_taken_, 1e-6 * static_cast<double>(bytes_), frames_, connections_, asked_);
  }

  static void say(const std::string& what) { std::cerr << "brachy relay: " << what << std::endl; }

  const RelayOptions options_;
  const net::BrokerOptions broker_;
  net::ServerOptions server_options_;  // its port is the one bound, once there is one
  std::optional<std::uint16_t> http_port_;
  asio::io_context io_{1};
  std::optional<asio::thread_pool> handshakes_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  asio::signal_set signals_{io_, SIGINT, SIGTERM};
  asio::steady_timer duration_{io_}, retire_timer_{io_};
  std::exception_ptr failure_;
  bool is_ending_ = false, was_opened_ = false;
  bool is_missed_ = false;  // viewers have been notified that messages are missing

  std::uint64_t publisher_ = 0;  // the daemon's; 0: none yet
  net::ArrivalOffset arrivals_;
  net::ServerMessages messages_{message_handlers()};
  std::string_view refusal_;  // by a handler, of the message it was given
  std::optional<net::WelcomeMessage> welcome_;
  std::optional<net::TopologyMessage> topology_;
  std::optional<net::SceneMessage> scene_;
  std::optional<net::PlanMessage> plan_;
  std::optional<net::DoseMessage> dose_;
  net::Bytes dose_body_;
  net::StateMessage state_;

  std::unique_ptr<Stage> stage_;                // null: no frame yet
  std::unique_ptr<Stage> replaced_;             // of the daemon before, until there is a frame; null: none
  std::deque<std::unique_ptr<Stage>> retired_;  // stopped
  bool is_connected_ = false;                   // to the broker
  std::int64_t heard_ns_ = 0;                   // when the daemon's last message came
  std::uint64_t messages_taken_ = 0, bytes_ = 0, frames_ = 0, asked_ = 0, connections_ = 0, daemons_ = 0;
  std::jthread feed_;
};

int run(const RelayOptions& options) {
  std::signal(SIGPIPE, SIG_IGN);
  return Relay(options).run();
}

void declare(OptionList& list, RelayOptions& options) {
  list.add("--nats", options.broker, "the NATS server: nats://[USER:PASSWORD@ or TOKEN@]HOST:4222")
      .required();
  list.add("--session", options.session, "the daemon's broker.session").show_default();
  list.add("--nats-ca", options.broker_ca, "CA that signed the NATS server's certificate (PEM)");
  const Option own =
      list.add("--nats-certificate", options.broker_certificate, "client certificate for NATS (PEM)");
  own.needs(list.add("--nats-key", options.broker_key, "its key (PEM)").needs(own));
  list.add("--address", options.address, "address to listen on; other than loopback requires token and TLS")
      .show_default();
  list.add("--port", options.port, "port for viewers; 0: a free one").range(0, 65535).show_default();
  list.add("--http-port", options.http_port, "port of the viewer for browsers; 0: a free one")
      .range(0, 65535);
  list.add("--token-file", options.token_file, "token that viewers must send (`brachy token`)");
  const Option certificate =
      list.add("--tls-certificate", options.tls_certificate, "certificate for TLS with viewers (PEM)");
  certificate.needs(list.add("--tls-key", options.tls_key, "its key (PEM)").needs(certificate));
  list.add("--max-clients", options.max_clients, "clients on all ports together")
      .range(1, 65535)
      .show_default();
  list.add("--max-clients-per-address", options.max_clients_per_address, "clients of one address")
      .range(1, 65535)
      .show_default();
  list.add_flag("--insecure-allow-remote", options.insecure_allow_remote,
                "allow --address to be other than loopback without a token and TLS");
  as_duration(list.add("--duration", options.duration_s, "end after this many seconds"));
  list.add_flag("--json", options.json, "print what was relayed as JSON at the end");
}

}  // namespace

Tool relay_tool() {
  return make_tool<RelayOptions>(
      "relay", "Serve viewers, on any host, a session that a daemon publishes to a NATS server.",
      R"(Examples:
  nats-server -a 127.0.0.1                               Debian: apt install nats-server
  brachyd --config config/prostate.toml --nats nats://127.0.0.1:4222
  brachy relay --nats nats://127.0.0.1:4222 --port 18960 --http-port 18961
  brachy watch --connect 127.0.0.1:18960                 or a browser at http://127.0.0.1:18961
  brachy relay --nats tls://TOKEN@broker.example:4222 --nats-ca ca.pem --session theatre-2 --address 0.0.0.0 \
    --token-file viewer.token --tls-certificate relay.pem --tls-key relay.key
Viewers receive the same messages as from the daemon (net/PROTOCOL.md) and can only watch: devices and
operators connect to the daemon. With --http-port there are /healthz and /metrics. Once the session is found,
the first line of output is: brachy relay listening on ADDRESS:PORT. While the broker or the daemon is away, the
relay waits.
Exit codes: 0 ended by Ctrl-C or --duration, 1 failed while running, 2 bad usage, or the port is in use.)",
      declare, run);
}

}  // namespace brachy
