#include "net/c_api/brachyd_client.h"

#include <gtest/gtest.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "net/transport/tls/tls_context.h"
#include "net/wire/codec.h"
#include "tests/net/http/http_testing.h"
#include "tests/net/transport/tls/certificates.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

using Handle = std::unique_ptr<BrachydClient, void (*)(BrachydClient*)>;

Handle new_client() {
  return {brachyd_create(), brachyd_destroy};
}

std::string text_of(const Handle& client) {
  return brachyd_error_text(client.get());
}

/// Says what it is given to the first client, over TLS if it has that, then ends its side and reads until the client
/// leaves.
class SpokenServer {
 public:
  explicit SpokenServer(Bytes words, TlsContext tls = {})
      : acceptor_(io_, {boost::asio::ip::address_v4::loopback(), 0}),
        thread_([this, words = std::move(words), tls = std::move(tls)] {
          boost::asio::ip::tcp::socket socket(io_);
          acceptor_.accept(socket);
          boost::system::error_code error;
          if (tls) {
            boost::asio::ssl::stream<boost::asio::ip::tcp::socket&> stream(socket, *tls);
            stream.handshake(boost::asio::ssl::stream_base::server, error);
            if (!error) boost::asio::write(stream, boost::asio::buffer(words), error);
          } else {
            boost::asio::write(socket, boost::asio::buffer(words), error);
          }
          socket.shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
          std::vector<std::byte> heard;
          boost::asio::read(socket, boost::asio::dynamic_buffer(heard), error);
        }) {}
  int port() const { return acceptor_.local_endpoint().port(); }

 private:
  boost::asio::io_context io_;
  boost::asio::ip::tcp::acceptor acceptor_;
  std::jthread thread_;
};

Bytes words(const auto&... messages) {
  Bytes bytes;
  std::uint64_t sequence = 0;
  (encode(messages, ++sequence, 1000, bytes), ...);
  return bytes;
}

WelcomeMessage device_welcome() {
  WelcomeMessage welcome;
  welcome.role = Role::kDevice;
  welcome.needle = 2;
  welcome.needle_count = 3;
  welcome.server = "fake 1";
  return welcome;
}

// Polls until the connection has ended; the bits of all that came.
int poll_to_the_end(const Handle& client) {
  int all = 0;
  for (;;) {
    const int news = brachyd_poll(client.get(), 60);
    if (news < 0) return all;
    all |= news;
  }
}

TEST(CApi, FailsByStatusAndTextForEveryArgumentThatIsWrong) {
  const Handle client = new_client();
  BrachydOptions options;
  brachyd_init_options(&options, sizeof options);
  EXPECT_EQ(brachyd_connect(nullptr, "127.0.0.1", 1, nullptr), kBrachydBadArgument);
  EXPECT_EQ(brachyd_connect(client.get(), nullptr, 1, nullptr), kBrachydBadArgument);
  for (const int port : {-1, 0, 65536}) {
    EXPECT_EQ(brachyd_connect(client.get(), "127.0.0.1", port, nullptr), kBrachydBadArgument);
    EXPECT_EQ(text_of(client), "the port must be 1 to 65535");
  }
  for (const double timeout_s : {0.0, -1.0, 1e9, std::nan("")}) {
    options.timeout_s = timeout_s;
    EXPECT_EQ(brachyd_connect(client.get(), "127.0.0.1", 1, &options), kBrachydBadArgument);
  }
  brachyd_init_options(&options, sizeof options);
  options.role = 4;
  EXPECT_EQ(brachyd_connect(client.get(), "127.0.0.1", 1, &options), kBrachydBadArgument);
  BrachydOptions not_set{};
  EXPECT_EQ(brachyd_connect(client.get(), "127.0.0.1", 1, &not_set), kBrachydBadArgument);
  EXPECT_NE(text_of(client).find("brachyd_init_options"), std::string::npos);
  EXPECT_EQ(brachyd_poll(client.get(), std::nan("")), kBrachydBadArgument);
  EXPECT_EQ(brachyd_poll(client.get(), -1), kBrachydBadArgument);
  EXPECT_EQ(brachyd_get_frame(client.get(), nullptr), kBrachydBadArgument);
  EXPECT_EQ(brachyd_get_topology(client.get(), nullptr), kBrachydBadArgument);
  EXPECT_EQ(brachyd_send_pose(client.get(), nullptr, 0), kBrachydBadArgument);
  EXPECT_EQ(brachyd_set_scanner(client.get(), nullptr), kBrachydBadArgument);
  EXPECT_EQ(brachyd_control(client.get(), 5, 0, nullptr, 0), kBrachydBadArgument);
  EXPECT_EQ(brachyd_arm(client.get(), 70000), kBrachydBadArgument);
  EXPECT_EQ(brachyd_positions(nullptr), nullptr);
  EXPECT_STREQ(brachyd_error_text(nullptr), "the client is NULL");
  brachyd_destroy(nullptr);
}

TEST(CApi, WithoutAConnectionHasNothingAndSendsNothing) {
  const Handle client = new_client();
  BrachydFrame frame;
  BrachydForce force;
  BrachydEvent event;
  const double pose[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_EQ(brachyd_is_open(client.get()), 0);
  EXPECT_EQ(brachyd_poll(client.get(), 0), kBrachydClosed);
  EXPECT_EQ(text_of(client), "there is no connection");
  EXPECT_EQ(brachyd_get_frame(client.get(), &frame), kBrachydNothing);
  EXPECT_EQ(brachyd_get_force(client.get(), &force), kBrachydNothing);
  EXPECT_EQ(brachyd_next_event(client.get(), &event), kBrachydNothing);
  EXPECT_EQ(brachyd_positions(client.get()), nullptr);
  EXPECT_EQ(brachyd_send_pose(client.get(), pose, 0), kBrachydClosed);
  for (int status = 1; status >= kBrachydInternal; --status) EXPECT_NE(brachyd_status_text(status), nullptr);
}

TEST(CApi, SaysWhereNobodyListens) {
  int port = 0;
  {
    boost::asio::io_context io;
    port = boost::asio::ip::tcp::acceptor(io, {boost::asio::ip::address_v4::loopback(), 0})
               .local_endpoint()
               .port();
  }
  const Handle client = new_client();
  EXPECT_EQ(brachyd_connect(client.get(), "127.0.0.1", port, nullptr), kBrachydUnreachable);
  EXPECT_NE(text_of(client).find("nothing listens on 127.0.0.1:" + std::to_string(port)), std::string::npos);
}

TEST(CApi, ARefusalHasItsCodeAndText) {
  SpokenServer server(words(ErrorMessage{ErrorCode::kDeviceBusy, true, 0, 1, "held by touch"}));
  const Handle client = new_client();
  EXPECT_EQ(brachyd_connect(client.get(), "127.0.0.1", server.port(), nullptr), kBrachydRefused);
  EXPECT_EQ(text_of(client), "held by touch");
  BrachydError error;
  ASSERT_EQ(brachyd_next_error(client.get(), &error), kBrachydOk);
  EXPECT_EQ(error.code, 5u);
  EXPECT_EQ(error.fatal, 1);
  EXPECT_STREQ(error.text, "held by touch");
  EXPECT_EQ(brachyd_next_error(client.get(), &error), kBrachydNothing);
  EXPECT_EQ(brachyd_poll(client.get(), 0), kBrachydNewError);
  EXPECT_EQ(brachyd_poll(client.get(), 0), kBrachydRefused);
}

TEST(CApi, GivesMeshNeedlesSeedsForceStateAndImagesAsTheyCame) {
  const TopologyMessage topology = sample_topology();
  FrameMessage full = sample_frame();
  full.full = true;
  full.base_tick = 0;
  full.ranges = {{0, full.point_count}};
  full.positions.assign(3 * full.point_count, 1.5f);
  full.seed_count = 1;
  full.seeds[0].id = 1;
  SpokenServer server(words(device_welcome(), topology, full, sample_force(), sample_state(), sample_image(),
                            sample_scanner(), sample_event()));
  const Handle client = new_client();
  ASSERT_EQ(brachyd_connect(client.get(), "127.0.0.1", server.port(), nullptr), kBrachydOk)
      << text_of(client);
  BrachydWelcome welcome;
  ASSERT_EQ(brachyd_get_welcome(client.get(), &welcome), kBrachydOk);
  EXPECT_EQ(welcome.needle, 2u);
  EXPECT_STREQ(welcome.server, "fake 1");
  EXPECT_EQ(poll_to_the_end(client), kBrachydNewTopology | kBrachydNewFrame | kBrachydNewForce |
                                         kBrachydNewState | kBrachydNewImage | kBrachydNewScanner |
                                         kBrachydNewEvent);
  BrachydTopology mesh;
  ASSERT_EQ(brachyd_get_topology(client.get(), &mesh), kBrachydOk);
  EXPECT_EQ(mesh.hash, topology.hash);
  ASSERT_EQ(mesh.triangle_count, topology.triangles.size());
  for (std::size_t i = 0; i < 3 * topology.triangles.size(); ++i)
    EXPECT_EQ(mesh.triangles[i], topology.triangles[i / 3][i % 3]);
  ASSERT_EQ(mesh.point_count, topology.rest_vertices.size() / 3);
  const float* positions = brachyd_positions(client.get());
  for (std::size_t i = 0; i < topology.rest_vertices.size(); ++i) {
    EXPECT_EQ(mesh.rest_positions[i], topology.rest_vertices[i]);
    EXPECT_EQ(positions[i], 1.5f);
  }
  BrachydFrame frame;
  ASSERT_EQ(brachyd_get_frame(client.get(), &frame), kBrachydOk);
  EXPECT_EQ(frame.tick, full.tick);
  EXPECT_EQ(frame.verdict, 1);
  ASSERT_EQ(frame.needle_count, 1u);
  BrachydNeedle needle;
  ASSERT_EQ(brachyd_get_needle(client.get(), 0, &needle), kBrachydOk);
  EXPECT_EQ(needle.contact, kBrachydInserted);
  EXPECT_EQ(needle.X_WN[11], full.needles[0].state.X_WN.p.z());
  EXPECT_EQ(needle.X_WN[1], full.needles[0].state.X_WN.R(0, 1));
  EXPECT_EQ(needle.force_n[2], full.needles[0].state.forces.force_n.z());
  EXPECT_EQ(brachyd_get_needle(client.get(), 1, &needle), kBrachydBadArgument);
  ASSERT_EQ(frame.seed_count, 1u);
  BrachydSeed seed;
  ASSERT_EQ(brachyd_get_seed(client.get(), 0, &seed), kBrachydOk);
  EXPECT_EQ(seed.position[2], full.seeds[0].position.z());
  EXPECT_EQ(brachyd_get_seed(client.get(), 1, &seed), kBrachydBadArgument);
  BrachydForce force;
  ASSERT_EQ(brachyd_get_force(client.get(), &force), kBrachydOk);
  const ForceMessage sent = sample_force();
  EXPECT_EQ(force.force_n[2], sent.forces.force_n.z());
  EXPECT_EQ(force.flags, sent.flags);
  EXPECT_GT(force.received_ns, 0);
  BrachydState state;
  ASSERT_EQ(brachyd_get_state(client.get(), &state), kBrachydOk);
  EXPECT_EQ(state.poses_accepted, sample_state().poses_accepted);
  BrachydImage image;
  ASSERT_EQ(brachyd_get_image(client.get(), kBrachydAnyArray, &image), kBrachydOk);
  EXPECT_EQ(image.width, sample_image().width);
  EXPECT_EQ(image.pixels[1], 0x40);
  EXPECT_EQ(image.X_WI[7], sample_image().X_WI.p.y());
  EXPECT_EQ(brachyd_get_image(client.get(), kBrachydTransverse, &image), kBrachydNothing);
  BrachydEvent event;
  ASSERT_EQ(brachyd_next_event(client.get(), &event), kBrachydOk);
  EXPECT_EQ(event.text, sample_event().text);
}

TEST(CApi, APoseThatIsNoNumberIsNotSent) {
  SpokenServer server(words(device_welcome()));
  const Handle client = new_client();
  ASSERT_EQ(brachyd_connect(client.get(), "127.0.0.1", server.port(), nullptr), kBrachydOk)
      << text_of(client);
  for (int i = 0; i < 12; ++i) {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
      double pose[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
      pose[i] = bad;
      EXPECT_EQ(brachyd_send_pose(client.get(), pose, 0), kBrachydBadArgument);
    }
  }
  EXPECT_NE(text_of(client).find("send nothing while tracking is lost"), std::string::npos);
}

TEST(CApi, TheSameHandleConnectsAgainAndForgetsWhatCameBefore) {
  const Handle client = new_client();
  for (int round = 0; round < 2; ++round) {
    SpokenServer server(words(device_welcome(), EventMessage{EventKind::kNote, 0, 0, "hello"}));
    ASSERT_EQ(brachyd_connect(client.get(), "127.0.0.1", server.port(), nullptr), kBrachydOk)
        << text_of(client);
    EXPECT_EQ(poll_to_the_end(client), kBrachydNewEvent);
    brachyd_close(client.get());  // the event stays
  }
  BrachydEvent event;
  EXPECT_EQ(brachyd_next_event(client.get(), &event), kBrachydOk);
  EXPECT_EQ(brachyd_next_event(client.get(), &event), kBrachydNothing);
}

// A server's certificate and the option `tls_ca` of a client; empty: without TLS.
struct TlsCase {
  std::string certificate_holds;
  std::string authority;
  std::string says;  // empty: the client is welcomed
};

TEST(CApi, OverTlsTrustsItsAuthorityAloneAndSaysWhyNot) {
  const TemporaryFolder folder;
  const TestCa ca(folder.path()), other(folder.path(), "other");
  const std::string known = ca.certificate(), foreign = other.certificate();
  for (const auto& [holds, authority, says] :
       std::initializer_list<TlsCase>{{"IP:127.0.0.1", known, ""},
                                      {"IP:127.0.0.1", foreign, "certificate"},
                                      {"DNS:elsewhere.example", known, "certificate"},
                                      {"", known, "TLS"},
                                      {"IP:127.0.0.1", "", "closed"},
                                      {"IP:127.0.0.1", folder.path() / "nosuch.pem", "nosuch.pem"}}) {
    TlsContext context;
    if (!holds.empty()) {
      const Identity identity = ca.issue("server", {.holds = holds});
      context = make_server_context({identity.certificate, identity.key, {}}, [](const std::string&) {});
    }
    SpokenServer server(words(device_welcome(), EventMessage{EventKind::kNote, 0, 0, "hello"}), context);
    BrachydOptions options;
    brachyd_init_options(&options, sizeof options);
    options.tls = authority.empty() ? 0 : 1;
    authority.copy(options.tls_ca, sizeof options.tls_ca - 1);
    Handle client = new_client();
    const int status = brachyd_connect(client.get(), "127.0.0.1", server.port(), &options);
    if (says.empty()) {
      ASSERT_EQ(status, kBrachydOk) << text_of(client);
      EXPECT_EQ(poll_to_the_end(client), kBrachydNewEvent);
    } else {
      EXPECT_LT(status, 0) << holds << " " << authority;
      EXPECT_NE(text_of(client).find(says), std::string::npos) << text_of(client);
      if (says == "nosuch.pem") {  // nobody has come yet, for whom the server waits
        boost::asio::io_context io;
        boost::asio::ip::tcp::socket socket(io);
        socket.connect({boost::asio::ip::address_v4::loopback(), static_cast<unsigned short>(server.port())});
      }
    }
  }
}

TEST(CApi, OfManyEventsTheNewestWait) {
  Bytes bytes = words(device_welcome());
  for (std::uint64_t i = 2; i < 402; ++i) encode(EventMessage{EventKind::kNote, 0, i, "x"}, i, 0, bytes);
  SpokenServer server(bytes);
  const Handle client = new_client();
  ASSERT_EQ(brachyd_connect(client.get(), "127.0.0.1", server.port(), nullptr), kBrachydOk);
  poll_to_the_end(client);
  BrachydEvent event;
  ASSERT_EQ(brachyd_next_event(client.get(), &event), kBrachydOk);
  EXPECT_EQ(event.tick, 402u - 256u);
}

}  // namespace
}  // namespace brachy::net::test
