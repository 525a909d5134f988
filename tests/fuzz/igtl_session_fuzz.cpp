// An OpenIGTLink client beside a native server and a running simulation: a script of the actions of all. Everything
// that is sent is well-formed, and the client's needles are free once it has left.
#include "net/igtl/igtl_session.h"

#include <boost/asio/io_context.hpp>

#include "net/base/clock.h"
#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/crc64.h"
#include "net/server/server.h"
#include "tests/fuzz/fuzzed_connection.h"
#include "tests/fuzz/igtl_script.h"
#include "tests/net/fake_simulation.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::fuzz {
namespace {

using namespace net;

constexpr std::uint16_t kNeedles = 2;

class World {
 public:
  void play(Script& script) {
    take_commands(server_.requests());
    session_->start();
    while (!script.is_over()) step(script);
    session_->fail({igtl::StatusCode::kShutdown, 0, "Shutdown", "the server stops"});
    while (connection_->finish_write()) continue;
    EXPECT_TRUE(!connection_->is_open() || connection_->is_shut());
    EXPECT_TRUE(heard_.empty()) << "half a message was sent";
    connection_->leave();
    EXPECT_TRUE(is_closed_);
    for (std::uint16_t needle = 0; needle < kNeedles; ++needle) EXPECT_EQ(server_.lease_holder(needle), "");
  }

 private:
  static ServerOptions options() {
    ServerOptions options;
    options.needles = kNeedles;
    return options;
  }
  static ServerHandlers handlers() {
    ServerHandlers handlers;
    handlers.on_pose = [](std::uint16_t, const NeedlePose& pose) {
      return pose.X_WN.p.allFinite() ? PoseVerdict{} : PoseVerdict{false, 1, "not finite"};
    };
    return handlers;
  }

  static void take_commands(RequestHandlers& commands) {
    commands.set<ControlMessage>([](const ControlMessage&, const Sender&) {});
    commands.set<ArmMessage>([](const ArmMessage& arm, const Sender&) { EXPECT_LT(arm.needle, kNeedles); });
    commands.set<DropMessage>(
        [](const DropMessage& drop, const Sender&) { EXPECT_LT(drop.needle, kNeedles); });
  }

  void step(Script& script) {
    switch (script.u8() % 5) {
      case 0:
      case 1:
        return connection_->feed(next_igtl_message(script));
      case 2:
        connection_->finish_write();
        return;
      case 3: {
        simulation_.step();
        messages_.update(simulation_.snapshot(), real_clock().utc_ns());
        const std::uint8_t due = script.u8();
        if ((due & 4) != 0) {
          auto image = std::make_shared<ImageMessage>(net::test::sample_image());
          images_.update(image, real_clock().utc_ns());
          session_->offer_image(image->array);
        }
        return session_->offer((due & 1) != 0, (due & 2) != 0);
      }
      default:
        return session_->check_time(monotonic_ns() + std::int64_t{script.u8()} * 50'000'000);
    }
  }

  /// The output must consist of complete messages.
  void hear(std::span<const std::byte> bytes) {
    heard_.insert(heard_.end(), bytes.begin(), bytes.end());
    const std::span<const std::byte> all(heard_);
    std::size_t at = 0;
    while (all.size() - at >= igtl::kHeaderSize) {
      const igtl::Header header = igtl::decode_header(all.subspan(at));
      EXPECT_TRUE(header.version == 1 || header.version == 2) << header.version;
      EXPECT_LT(header.body_size, 1u << 20);
      if (all.size() - at - igtl::kHeaderSize < header.body_size) break;
      const auto body = all.subspan(at + igtl::kHeaderSize, static_cast<std::size_t>(header.body_size));
      EXPECT_EQ(igtl::crc64(body), header.crc) << header.type;
      at += igtl::kHeaderSize + body.size();
    }
    heard_.erase(heard_.begin(), heard_.begin() + static_cast<std::ptrdiff_t>(at));
  }

  boost::asio::io_context io_;
  const Tissue tissue_ = net::test::line_tissue(4);
  net::test::FakeSimulation simulation_{tissue_, 1, kNeedles};
  Server server_{io_, options(), tissue_, handlers()};
  igtl::SnapshotMessages messages_{tissue_, "gland"};
  igtl::ImageMessages images_;
  igtl::TrackingFeed tracking_;
  Bytes heard_;  // the beginning of a message
  bool is_closed_ = false;
  const std::shared_ptr<FuzzedConnection> connection_ =
      std::make_shared<FuzzedConnection>([this](std::span<const std::byte> bytes) { hear(bytes); });
  const std::shared_ptr<igtl::IgtlSession> session_ = std::make_shared<igtl::IgtlSession>(
      1, connection_, server_.gate().acquire_slot("127.0.0.1"),
      igtl::IgtlSession::Environment{server_, messages_, images_, tracking_, &server_.request_server(),
                                     std::chrono::milliseconds(1000),
                                     [this](const igtl::IgtlSession&, const std::string& reason) {
                                       EXPECT_FALSE(reason.empty());
                                       is_closed_ = true;
                                     },
                                     [] {}, [](const igtl::IgtlSession&, const std::string&) {}, [] {}});
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  World().play(script);
  return 0;
}

}  // namespace brachy::fuzz
