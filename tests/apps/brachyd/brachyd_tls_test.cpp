// brachyd with a certificate, tested with our tools, openssl's client and curl.
#include <sys/stat.h>

#include <csignal>
#include <fstream>

#include "net/transport/tls/tls_context.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/net/raw_peer.h"
#include "tests/net/transport/tls/certificates.h"

namespace brachy {
namespace {

using namespace test;
using net::test::Identity;
using net::test::TestCa;

/// A server's answer to another program.
struct Said : net::test::Heard {
  explicit Said(const std::string& bytes) { hear(std::as_bytes(std::span(bytes))); }
};

struct BrachydTls : ::testing::Test {
  std::string scene_with(const std::string& more = "") {
    return folder.write("scene.toml", small_scene("tls_certificate = \"" + server.certificate.string() +
                                                  "\"\ntls_key = \"" + server.key.string() +
                                                  "\"\nhttp_port = 0\nsilence_timeout_ms = 1500\n" + more));
  }
  /// From the daemon's second line.
  static std::string https_address(RunningBrachyd& daemon) {
    constexpr std::string_view kSays = "{\"https_on\":\"", kEnd = "\"}";
    const auto line = daemon.process.read_line();
    EXPECT_TRUE(line && line->starts_with(kSays)) << line.value_or("none");
    return line ? line->substr(kSays.size(), line->size() - kSays.size() - kEnd.size()) : "";
  }
  Ended watch(const RunningBrachyd& daemon, std::vector<std::string> tls) {
    std::vector<std::string> line = {"watch", "--connect", daemon.address, "--duration", "1", "--json"};
    line.insert(line.end(), tls.begin(), tls.end());
    return run_brachy(line);
  }

  TempFolder folder;
  TestCa ca{folder / ""};
  Identity server = ca.issue("server");
};

TEST_F(BrachydTls, ToolsWatchItOverTlsAndSayWhyTheyCannot) {
  RunningBrachyd daemon(scene_with());
  ChildProcess good(
      brachy_line({"watch", "--connect", daemon.address, "--json", "--tls-ca", ca.certificate().string()}));
  net::ClientOptions options;
  options.tls = net::make_client_context({ca.certificate().string(), "", ""});
  Peer beside(std::move(options));
  ASSERT_TRUE(beside.join(daemon.port));
  ASSERT_TRUE(beside.until([&] { return !beside.states.empty() && beside.states.back().viewers == 2; }));
  const std::size_t frames = beside.frames.size();
  ASSERT_TRUE(beside.until([&] { return beside.frames.size() > frames + 8; }));
  good.send_signal(SIGINT);
  const Ended ended = good.wait();
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_GT(json_of(ended)["snapshots"], 5);

  const Ended plain = watch(daemon, {});
  EXPECT_TRUE(exited(plain, 1));
  EXPECT_NE(plain.err.find("add --tls"), std::string::npos) << plain.err;
  const Ended unknown = watch(daemon, {"--tls"});
  EXPECT_TRUE(exited(unknown, 1));
  EXPECT_NE(unknown.err.find("--tls-ca"), std::string::npos) << unknown.err;
}

TEST_F(BrachydTls, AToolWithTlsIsToldThatADaemonSpeaksNone) {
  RunningBrachyd daemon(folder.write("plain.toml", small_scene()));
  const Ended ended = watch(daemon, {"--tls-ca", ca.certificate().string()});
  EXPECT_TRUE(exited(ended, 1));
  EXPECT_NE(ended.err.find("speaks no TLS"), std::string::npos) << ended.err;
}

TEST_F(BrachydTls, ClientsShowACertificateWhereOneIsAskedFor) {
  RunningBrachyd daemon(scene_with("tls_client_ca = \"" + ca.certificate().string() + "\"\n"));
  const Ended without = watch(daemon, {"--tls-ca", ca.certificate().string()});
  EXPECT_TRUE(exited(without, 1));
  EXPECT_NE(without.err.find("--tls-certificate"), std::string::npos) << without.err;
  const Identity own = ca.issue("client", {"client", ""});
  EXPECT_TRUE(exited(watch(daemon, {"--tls-ca", ca.certificate().string(), "--tls-certificate",
                                    own.certificate.string(), "--tls-key", own.key.string()}),
                     0));
}

TEST_F(BrachydTls, OpensslsClientIsASessionLikeAnyOther) {
  RunningBrachyd daemon(scene_with());
  net::Bytes hello;
  net::encode(net::HelloMessage{}, 1, 0, hello);
  std::ofstream(folder / "hello", std::ios::binary)
      .write(static_cast<const char*>(static_cast<const void*>(hello.data())),
             static_cast<std::streamsize>(hello.size()));
  // It sends HELLO and reads until the daemon misses an answer.
  const Ended ended = run_process(
      {"/bin/sh", "-c",
       "exec openssl s_client -quiet -verify_quiet -verify_return_error -connect " + daemon.address +
           " -CAfile " + ca.certificate().string() + " <" + (folder / "hello").string()});
  EXPECT_TRUE(exited(ended, 0));
  const Said said(ended.out);
  ASSERT_GE(said.types.size(), 3u) << ended.err;
  EXPECT_EQ(said.types[0], net::MessageType::kWelcome);
  EXPECT_GT(said.frames.size(), 5u);
  EXPECT_EQ(said.mesh.positions().size(), 3u * 3000);
  EXPECT_EQ(said.fatal(), net::ErrorCode::kTimeout);
}

TEST_F(BrachydTls, CurlGetsThePageFromAServerThatItCanCheck) {
  RunningBrachyd daemon(scene_with());
  const std::string address = https_address(daemon);
  const std::string port = address.substr(address.rfind(':') + 1);
  const std::vector<std::string> curl = {"/usr/bin/curl", "--silent",  "--show-error",
                                         "--include",     "--noproxy", "*"};
  const auto get = [&](const std::string& url, std::vector<std::string> more) {
    more.insert(more.begin(), curl.begin(), curl.end());
    more.push_back(url);
    return run_process(more);
  };
  const std::string trust = ca.certificate().string();
  for (const auto* host : {"127.0.0.1:", "localhost:"}) {
    const Ended good = get("https://" + (host + port) + "/", {"--cacert", trust, "--ipv4"});
    EXPECT_TRUE(exited(good, 0));
    EXPECT_TRUE(good.out.starts_with("HTTP/1.1 200 OK\r\n")) << good.out.substr(0, 400);
    EXPECT_NE(good.out.find("<html"), std::string::npos);
  }
  EXPECT_TRUE(exited(get("https://" + address + "/", {}), 60));  // no CA certifies it
  EXPECT_TRUE(exited(get("https://" + address + "/", {"--cacert", trust, "--tls-max", "1.1"}), 35));
  const Ended plain = get("http://" + address + "/", {});
  EXPECT_TRUE(plain.out.starts_with("HTTP/1.1 400 ")) << plain.out;
  EXPECT_NE(plain.out.find("https://"), std::string::npos);
}

TEST_F(BrachydTls, AKeyThatOthersMayReadIsRefusedInOneLine) {
  ASSERT_EQ(::chmod(server.key.c_str(), 0644), 0);
  const Ended ended = run_brachyd({"--config", scene_with(), "--port", "0"});
  EXPECT_TRUE(exited(ended, 2));
  EXPECT_EQ(ended.out, "");
  const std::string last = lines_of(ended.err).back();
  EXPECT_NE(last.find("chmod 600 " + server.key.string()), std::string::npos) << last;
}

}  // namespace
}  // namespace brachy
