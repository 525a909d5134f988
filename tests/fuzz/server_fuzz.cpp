// The native server with up to three clients at once, over TCP or WebSocket, and a running simulation: a script of the
// actions of all. Everything that the server sends is well-formed, and nothing of a client remains once it has left.
#include <array>
#include <boost/asio/io_context.hpp>

#include "net/server/server.h"
#include "tests/fuzz/fuzzed_connection.h"
#include "tests/fuzz/message_script.h"
#include "tests/net/fake_simulation.h"
#include "tests/net/raw_peer.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::fuzz {
namespace {

using namespace net;

constexpr std::uint16_t kNeedles = 2;

/// Heard, with the fuzzer's connection.
class Client : public net::test::Heard {
 public:
  Client(Server& server, bool is_websocket) : is_websocket_(is_websocket) {
    connection_ = std::make_shared<FuzzedConnection>([this](std::span<const std::byte> bytes) {
      EXPECT_EQ(fatal(), ErrorCode{}) << "something follows a fatal ERROR";
      hear(bytes);
    });
    server.adopt(connection_, server.gate().acquire_slot("127.0.0.1"));
  }
  ~Client() { connection_->leave(); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(const Bytes& message) {
    ++sent_;
    is_websocket_ ? connection_->feed_message(message) : connection_->feed(message);
  }
  void send_raw(std::span<const std::byte> bytes) {
    is_websocket_ ? connection_->feed_message(bytes) : connection_->feed(bytes);
  }
  std::uint64_t next_sequence() const { return sent_ + 1; }
  FuzzedConnection& connection() { return *connection_; }

  /// Reads everything; then the server has sent a reason, or has closed.
  void expect_end() {
    while (connection_->finish_write()) continue;
    EXPECT_TRUE(!connection_->is_open() || (connection_->is_shut() && fatal() != ErrorCode{}));
    for (const ErrorMessage& error : errors) EXPECT_FALSE(error.text.empty());
  }

 private:
  const bool is_websocket_;
  std::shared_ptr<FuzzedConnection> connection_;
  std::uint64_t sent_ = 0;
};

class World {
 public:
  /// With a token for all roles and one for devices and viewers, or with none.
  explicit World(bool has_tokens) : server_(io_, options(has_tokens), tissue_, handlers()) {
    server_.requests().set<ControlMessage>([](const ControlMessage& control, const Sender&) {
      return control.action == ControlAction::kModel ? "no other model" : "";
    });
  }

  void play(Script& script) {
    while (!script.is_over()) step(script);
    for (std::uint16_t needle = 0; needle < kNeedles; ++needle) server_.release_lease(needle);
    server_.stop();
    for (const auto& client : clients_)
      if (client) client->expect_end();
    EXPECT_EQ(server_.client_count(), 0u);
    clients_ = {};
    for (std::uint16_t needle = 0; needle < kNeedles; ++needle) EXPECT_EQ(server_.lease_holder(needle), "");
  }

 private:
  static ServerOptions options(bool has_tokens) {
    ServerOptions options;
    const Token all = *net::test::sample_hello_with_token().token;
    if (has_tokens) {
      options.tokens.add(all, {Role::kViewer, Role::kDevice, Role::kOperator});
      options.tokens.add(Token{}, {Role::kViewer, Role::kDevice});
    }
    options.needles = kNeedles;
    options.max_message_bytes = 1024;
    options.max_queued_messages = 8;
    options.max_clients = 2;  // the third gets BUSY
    return options;
  }

  static ServerHandlers handlers() {
    ServerHandlers handlers;
    handlers.on_pose = [](std::uint16_t, const NeedlePose& pose) {
      return pose.X_WN.p.allFinite() ? PoseVerdict{} : PoseVerdict{false, 1, "not finite"};
    };
    return handlers;
  }

  void step(Script& script) {
    auto& client = clients_[script.u8() % clients_.size()];
    const std::uint8_t action = script.u8() % 10;
    if (!client) client = std::make_unique<Client>(server_, action % 2 != 0);
    FuzzedConnection& connection = client->connection();
    switch (action) {
      case 0:
      case 1:
        return client->send(next_message(script, client->next_sequence()));
      case 2:
        return client->send_raw(script.piece());
      case 3:
        connection.finish_write();
        return;
      case 4:
        return client.reset();
      case 5:
        simulation_.step();
        server_.publish(simulation_.snapshot());
        io_.poll();
        return;
      case 6: {
        const auto needle = static_cast<std::uint16_t>(script.u8() % kNeedles);
        server_.send(needle, net::test::sample_force());
        server_.send(needle, net::test::sample_local_model());
        return;
      }
      case 7:
        return connection.set_unsent_bytes(script.u8());
      case 8:
        server_.publish(net::test::sample_dose());
        return server_.broadcast_state();
      default:
        server_.set_scene(net::test::sample_scene());
        server_.hold_lease(static_cast<std::uint16_t>(script.u8() % kNeedles), "script");
    }
  }

  boost::asio::io_context io_;
  const Tissue tissue_ = net::test::line_tissue(4);
  net::test::FakeSimulation simulation_{tissue_, 1, kNeedles};
  Server server_;
  std::array<std::unique_ptr<Client>, 3> clients_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  World(script.u8() % 2 != 0).play(script);
  return 0;
}

}  // namespace brachy::fuzz
