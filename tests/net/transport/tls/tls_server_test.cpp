// The native protocol over TLS: the same sessions; clients accepted and refused.
#include <algorithm>

#include "tests/net/transport/tls/tls_fixture.h"

namespace brachy::net::test {
namespace {

struct TlsServer : TlsFixture {
  void start_tls(ServerOptions options = {}) {
    options.tls = server_context();
    start(options);
  }
  bool is_welcomed(RawPeer& peer) {
    return until([&] {
             peer.take();
             return !peer.types.empty() || peer.is_ended();
           }) &&
           !peer.types.empty();
  }
  bool ends(RawPeer& peer) {
    return until([&] {
      peer.take();
      return peer.is_ended();
    });
  }
  bool is_logged(const std::string& part) {
    return until([&] {
      return std::ranges::any_of(
          log, [&](const std::string& line) { return line.find(part) != std::string::npos; });
    });
  }
};

TEST_F(TlsServer, AClientSeesTheMeshAndSteersTheNeedle) {
  start_tls();
  ClientOptions options;
  options.role = Role::kDevice;
  const auto device = join_over_tls(client_context(), options);
  ASSERT_EQ(device->welcomes, 1) << device->closed.at(0);
  for (std::size_t i = 1; i <= 20; ++i) {
    publish();
    ASSERT_TRUE(until([&] { return device->frames.size() == i; }));
    ASSERT_EQ(device->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  }
  RigidTransform X_WN;
  X_WN.p = Vec3(1, 2, 3);
  device->client.send_pose(X_WN, 5);
  ASSERT_TRUE(until([&] { return poses.size() == 1; }));
  EXPECT_EQ(poses[0].X_WN.p, Vec3(1, 2, 3));
  ForceMessage force;
  force.forces.force_n = Vec3(0, 0, -1);
  EXPECT_TRUE(server->send(0, force));
  ASSERT_TRUE(until([&] { return device->forces.size() == 1; }));
  EXPECT_EQ(device->forces[0].forces.force_n, Vec3(0, 0, -1));
  server->stop();
  ASSERT_TRUE(until([&] { return !device->closed.empty(); }));
  EXPECT_EQ(device->errors.at(0).code, ErrorCode::kShutdown);
}

TEST_F(TlsServer, AClientKnowsItsServerByItsCaOrByItself) {
  start_tls();
  EXPECT_EQ(join_over_tls(make_client_context({identity.certificate, {}, {}}))->welcomes, 1);
  EXPECT_EQ(join_over_tls(client_context(), {}, "localhost")->welcomes, 1);
}

TEST_F(TlsServer, AServerOfAnotherCaIsRefused) {
  start_tls();
  const TestCa other(folder.path(), "other");
  const auto client = join_over_tls(make_client_context({other.certificate(), {}, {}}));
  ASSERT_EQ(client->closed.size(), 1u);
  EXPECT_NE(client->closed[0].find("--tls-ca"), std::string::npos) << client->closed[0];
  EXPECT_TRUE(is_logged("refuses our certificate"));
  const auto of_the_system = join_over_tls(make_client_context({}));
  ASSERT_EQ(of_the_system->closed.size(), 1u);
  EXPECT_NE(of_the_system->closed[0].find("--tls-ca"), std::string::npos) << of_the_system->closed[0];
}

TEST_F(TlsServer, ACertificateForAnotherNameIsRefused) {
  CertificateText text;
  text.holds = "DNS:simulator.example,IP:127.0.0.2";
  identity = ca.issue("elsewhere", text);
  start_tls();
  for (const auto* host : {"127.0.0.1", "localhost"}) {
    const auto client = join_over_tls(client_context(), {}, host);
    ASSERT_EQ(client->closed.size(), 1u) << host;
    EXPECT_NE(client->closed[0].find("another name"), std::string::npos) << client->closed[0];
  }
}

TEST_F(TlsServer, ACertificateThatHasEndedIsRefused) {
  CertificateText text;
  text.ends_s = -60;
  identity = ca.issue("ended", text);
  start_tls();
  const auto client = join_over_tls(client_context());
  ASSERT_EQ(client->closed.size(), 1u);
  EXPECT_NE(client->closed[0].find("has ended"), std::string::npos) << client->closed[0];
}

TEST_F(TlsServer, OldVersionsAreRefused) {
  start_tls();
  TlsContext old = careless_context();
  SSL_CTX_set_max_proto_version(old->native_handle(), TLS1_1_VERSION);
  RawPeer peer(io, server->port(), 0, old);
  peer.hello();
  EXPECT_FALSE(is_welcomed(peer));
  EXPECT_NE(peer.socket().failure(), "");
  EXPECT_TRUE(is_logged("no TLS 1.2"));

  TlsContext oldest_good = careless_context();
  SSL_CTX_set_max_proto_version(oldest_good->native_handle(), TLS1_2_VERSION);
  RawPeer good(io, server->port(), 0, oldest_good);
  good.hello();
  EXPECT_TRUE(is_welcomed(good)) << good.socket().failure();
  EXPECT_STREQ(SSL_get_version(good.socket().tls()), "TLSv1.2");
}

TEST_F(TlsServer, OnlySuitesWithForwardSecrecyAndAuthenticatedEncryptionAreSpoken) {
  start_tls();
  const auto with = [&](const char* suites) {
    TlsContext context = careless_context();
    SSL_CTX_set_max_proto_version(context->native_handle(), TLS1_2_VERSION);
    EXPECT_EQ(SSL_CTX_set_cipher_list(context->native_handle(), suites), 1) << suites;
    RawPeer peer(io, server->port(), 0, context);
    peer.hello();
    return is_welcomed(peer);
  };
  EXPECT_TRUE(with("ECDHE+AESGCM"));
  EXPECT_TRUE(with("ECDHE+CHACHA20"));
  EXPECT_FALSE(with("ECDHE+AES:!AESGCM:!AESCCM")) << "CBC";
  EXPECT_FALSE(with("AES256-GCM-SHA384:AES128-SHA")) << "the certificate's key encrypts the session's";
}

TEST_F(TlsServer, NeitherCompressionNorTicketsNorRenegotiation) {
  ServerOptions options;
  options.state_interval = std::chrono::hours(1);  // nothing comes in between
  start_tls(options);
  TlsContext v1_2 = careless_context();
  SSL_CTX_set_max_proto_version(v1_2->native_handle(), TLS1_2_VERSION);
  RawPeer peer(io, server->port(), 0, v1_2);
  peer.hello(Role::kViewer, kSubscribeNoMesh);
  ASSERT_TRUE(is_welcomed(peer));
  SSL* handle = peer.socket().tls();
  EXPECT_EQ(SSL_get_current_compression(handle), nullptr);
  EXPECT_EQ(SSL_SESSION_has_ticket(SSL_get0_session(handle)), 0);
  ASSERT_EQ(SSL_renegotiate(handle), 1);
  SSL_do_handshake(handle);
  peer.send({});
  EXPECT_TRUE(ends(peer));
  EXPECT_EQ(peer.socket().failure(), "no renegotiation");
}

TEST_F(TlsServer, WithoutACertificateNobodyGetsInWhereOneIsAskedFor) {
  ServerOptions options;
  options.tls = server_context(ca.certificate());
  start(options);
  const auto without = join_over_tls(client_context());
  ASSERT_EQ(without->closed.size(), 1u);
  EXPECT_NE(without->closed[0].find("--tls-certificate"), std::string::npos) << without->closed[0];
  EXPECT_TRUE(is_logged("shows no certificate"));

  const TestCa other(folder.path(), "other");
  const Identity strange = other.issue("strange");
  const auto wrong = join_over_tls(make_client_context({ca.certificate(), strange.certificate, strange.key}));
  ASSERT_EQ(wrong->closed.size(), 1u);
  EXPECT_NE(wrong->closed[0].find("--tls-certificate"), std::string::npos) << wrong->closed[0];
  EXPECT_TRUE(is_logged("its certificate is refused"));

  const Identity own = ca.issue("client", {"client", ""});
  const auto client = join_over_tls(make_client_context({ca.certificate(), own.certificate, own.key}));
  EXPECT_EQ(client->welcomes, 1);
}

TEST_F(TlsServer, TheAskForACertificateIsUnderstoodInTls12Too) {
  ServerOptions options;
  options.tls = server_context(ca.certificate());
  start(options);
  TlsContext v1_2 = client_context();
  SSL_CTX_set_max_proto_version(v1_2->native_handle(), TLS1_2_VERSION);
  const auto without = join_over_tls(v1_2);
  ASSERT_EQ(without->closed.size(), 1u);
  EXPECT_NE(without->closed[0].find("--tls-certificate"), std::string::npos) << without->closed[0];
}

TEST_F(TlsServer, APlainClientIsToldThatThisPortSpeaksTls) {
  start_tls();
  const auto plain = join();
  ASSERT_TRUE(until([&] { return !plain->closed.empty(); }));
  EXPECT_EQ(plain->closed[0], "this server speaks TLS: add --tls");
  EXPECT_TRUE(is_logged("it speaks no TLS"));
  EXPECT_TRUE(until([&] { return server->client_count() == 0; }));
}

TEST_F(TlsServer, ATlsClientIsToldThatAPortSpeaksNone) {
  start();
  const auto client = join_over_tls(client_context());
  ASSERT_EQ(client->closed.size(), 1u);
  EXPECT_EQ(client->closed[0], "this server speaks no TLS: leave out the options --tls…");
  EXPECT_TRUE(is_logged("no TLS is spoken on this port"));
  EXPECT_TRUE(until([&] { return server->client_count() == 0; }));
}

TEST_F(TlsServer, OneTooManyIsToldBusy) {
  ServerOptions options;
  options.max_clients = 2;
  start_tls(options);
  const auto first = join_over_tls(client_context()), second = join_over_tls(client_context());
  ASSERT_EQ(server->client_count(), 2u);
  const auto third = join_over_tls(client_context());
  ASSERT_EQ(third->errors.size(), 1u) << third->closed.at(0);
  EXPECT_EQ(third->errors[0].code, ErrorCode::kBusy);
  ASSERT_TRUE(until([&] { return !third->closed.empty(); }));
  first->client.close();
  ASSERT_TRUE(until([&] { return server->client_count() == 1; }));
  EXPECT_EQ(join_over_tls(client_context())->welcomes, 1);
}

}  // namespace
}  // namespace brachy::net::test
