// Access control of a running brachyd, and the capabilities that it keeps.
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>
#include <thread>

#include "apps/daemon/daemon_setup.h"
#include "core/base/error.h"
#include "core/scene/file/scene_file.h"
#include "net/access/token_file.h"
#include "net/session/server_options.h"
#include "tests/apps/http_get.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"
#include "tests/net/raw_peer.h"

namespace brachy {
namespace {

using namespace test;

struct BrachydAccess : ::testing::Test {
  std::string token(const std::string& name) {
    const std::string file = (folder / name).string();
    EXPECT_TRUE(exited(run_brachy({"token", file}), 0));
    return file;
  }
  std::string scene(const std::string& server_keys) {
    return folder.write("scene.toml", small_scene(server_keys));
  }

  TempFolder folder;
};

/// A thread's status in /proc: "CapEff" → "0000000000000000", …
using ThreadStatus = std::map<std::string, std::string>;

std::vector<ThreadStatus> threads_of(pid_t pid) {
  std::vector<ThreadStatus> all;
  std::error_code gone;
  for (const auto& task :
       std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task", gone)) {
    ThreadStatus status;
    const auto thread = static_cast<pid_t>(std::stoi(task.path().filename().string()));
    status["policy"] = std::to_string(::sched_getscheduler(thread) & ~SCHED_RESET_ON_FORK);
    std::ifstream file(task.path() / "status");
    for (std::string key, value; file >> key >> value; file.ignore(4096, '\n'))
      status[key.substr(0, key.find(':'))] = value;
    if (!status.empty()) all.push_back(status);
  }
  return all;
}

bool has_no_capability(const ThreadStatus& status) {
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapAmb"})
    if (!status.contains(set) || status.at(set).find_first_not_of('0') != std::string::npos) return false;
  return status.contains("NoNewPrivs") && status.at("NoNewPrivs") == "1";
}

bool this_process_has_one() {
  return threads_of(::getpid()).at(0).at("CapPrm").find_first_not_of('0') != std::string::npos;
}

TEST_F(BrachydAccess, ToolsWithATokenAreLetInAndOthersAreToldWhatTheyLack) {
  const std::string any = token("any.token"), viewer = token("viewer.token"), wrong = token("wrong.token");
  RunningBrachyd brachyd(scene("token_file = \"any.token\"\nviewer_token_file = \"viewer.token\"\n"));
  const auto watch = [&](std::vector<std::string> more) {
    std::vector<std::string> line = {"watch", "--connect", brachyd.address, "--duration", "0.3", "--json"};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  EXPECT_TRUE(exited(watch({"--token-file", any}), 0));
  EXPECT_TRUE(exited(watch({"--token-file", viewer}), 0));
  const Ended none = watch({}), other = watch({"--token-file", wrong});
  EXPECT_TRUE(exited(none, 1));
  EXPECT_NE(none.err.find("--token-file"), std::string::npos) << none.err;
  EXPECT_EQ(none.out, "") << "no counters of nothing";
  const Ended lines = run_brachy({"watch", "--connect", brachyd.address, "--duration", "0.3"});
  EXPECT_TRUE(exited(lines, 1));
  EXPECT_EQ(lines.out, "") << "nor lines of zeros";
  EXPECT_TRUE(exited(other, 1));
  EXPECT_NE(other.err.find("not known to this daemon"), std::string::npos) << other.err;
  const std::string motion = folder.write("motion.csv", short_insertion(0.3));
  EXPECT_TRUE(exited(run_brachy({"replay", motion, "--connect", brachyd.address, "--token-file", any}), 0));
  const Ended replay = run_brachy({"replay", motion, "--connect", brachyd.address, "--token-file", viewer});
  EXPECT_TRUE(exited(replay, 1));
  EXPECT_NE(replay.err.find("role"), std::string::npos) << replay.err;
  brachyd.process.send_signal(SIGTERM);
  EXPECT_EQ(json_of(brachyd.process.wait()).at("wrong_tokens"), 1);
}

TEST_F(BrachydAccess, ATokenIsMadeOnceAndShownForTheBrowser) {
  const std::string file = token("t");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"token", file}), {"t: exists already"}));
  const Ended shown = run_brachy({"token", "--show", file});
  EXPECT_TRUE(exited(shown, 0));
  EXPECT_EQ(shown.out, net::to_hex(net::load_token(file)) + "\n");
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"token", "--show", (folder / "none").string()}), {"no such token"}));
}

// It shows a patient.
TEST_F(BrachydAccess, TheVolumeIsServedToAViewersTokenOnly) {
  const std::string viewer = token("viewer.token"), other = token("other.token");
  NrrdText image;
  image.sizes = "2 2 2";
  image.directions = "(40,0,0) (0,40,0) (0,0,40)";
  image.origin = "(-20,-20,-20)";
  folder.write("volume.nrrd", image.header() + std::string("\1\2\3\4\5\6\7\10", 8));
  RunningBrachyd brachyd(
      scene("http_port = 0\nviewer_token_file = \"viewer.token\"\n"
            "[display]\nvolume = \"volume.nrrd\"\n"));
  const std::uint16_t port = http_port(brachyd);
  ASSERT_NE(port, 0);
  const auto with_token = [](const std::string& file) {
    return "Authorization: Bearer " + net::to_hex(net::load_token(file)) + "\r\n";
  };
  for (const std::string& more : {std::string(), with_token(other)}) {
    const std::string refused = http_get(port, "/volume", more);
    EXPECT_TRUE(refused.starts_with("HTTP/1.1 401 ")) << refused.substr(0, 200);
    EXPECT_EQ(refused.find("NRRD"), std::string::npos);
  }
  const std::string served = http_get(port, "/volume", with_token(viewer));
  EXPECT_TRUE(served.starts_with("HTTP/1.1 200 ")) << served.substr(0, 200);
  EXPECT_TRUE(body_of(served).starts_with("NRRD"));
}

TEST_F(BrachydAccess, ATokenThatOthersMayReadIsRefusedAtTheStart) {
  const std::string file = token("t");
  ASSERT_EQ(::chmod(file.c_str(), 0644), 0);
  const Ended ended = run_brachyd({"--check-config", scene("token_file = \"t\"\n")});
  EXPECT_TRUE(exited(ended, 2));
  EXPECT_NE(ended.err.find("chmod 600"), std::string::npos) << ended.err;
}

TEST_F(BrachydAccess, OpenIgtLinkWithTokensNeedsConsent) {
  token("t");
  const Ended ended = run_brachyd({"--check-config", scene("token_file = \"t\"\nigtl_port = 0\n")});
  EXPECT_TRUE(exited(ended, 2));
  EXPECT_NE(ended.err.find("igtl_without_token"), std::string::npos) << ended.err;
  EXPECT_TRUE(exited(run_brachyd({"--check-config",
                                  scene("token_file = \"t\"\nigtl_port = 0\nigtl_without_token = true\n")}),
                     0));
}

TEST_F(BrachydAccess, ATokenIsInNoFileAndNoLog) {
  const std::string file = token("t");
  const net::Token secret = net::load_token(file);
  RunningBrachyd brachyd(scene("token_file = \"t\"\n"), {"--session", (folder / "session").string()});
  const std::string motion = folder.write("motion.csv", short_insertion(0.3));
  ChildProcess record(brachy_line({"record", "--connect", brachyd.address, "--token-file", file, "--out",
                                   (folder / "r.brachy").string()}));
  EXPECT_TRUE(exited(run_brachy({"replay", motion, "--connect", brachyd.address, "--token-file", file}), 0));
  brachyd.process.send_signal(SIGTERM);
  const Ended daemon = brachyd.process.wait(), recorder = record.wait();
  EXPECT_TRUE(exited(daemon, 0));
  EXPECT_TRUE(exited(recorder, 0));
  std::map<std::string, std::string> written = {{"the daemon's output", daemon.out + daemon.err},
                                                {"the recorder's output", recorder.out + recorder.err},
                                                {"r.brachy", read_file(folder / "r.brachy")}};
  for (const auto& entry : std::filesystem::directory_iterator(folder / "session"))
    written[entry.path().filename().string()] = read_file(entry.path());
  EXPECT_TRUE(written.contains("poses.csv"));
  const std::string raw(reinterpret_cast<const char*>(secret.data()), 8);
  for (const auto& [name, text] : written) {
    EXPECT_NE(text, "") << name;
    EXPECT_EQ(text.find(raw), std::string::npos) << name;
    EXPECT_EQ(text.find(net::to_hex(secret).substr(0, 16)), std::string::npos) << name;
  }
}

TEST_F(BrachydAccess, AFloodOfClientsFillsNoLog) {
  RunningBrachyd brachyd(scene(""));
  boost::asio::io_context io;
  constexpr int kClients = 300;
  for (int i = 0; i < kClients; ++i) {
    net::test::RawPeer peer(io, brachyd.port);
    peer.send_message(net::PingMessage{});  // no HELLO: an ERROR, and a line in the log
    ASSERT_TRUE(wait_until([&] { return peer.is_ended(); }, [&] { peer.take(), std::this_thread::yield(); }));
  }
  brachyd.process.send_signal(SIGTERM);
  const Ended ended = brachyd.process.wait();
  EXPECT_TRUE(exited(ended, 0));
  const auto lines = lines_of(ended.err);
  const auto about_them = std::ranges::count_if(lines, [](const std::string& line) {
    return line.find("the first message must be HELLO") != std::string::npos;
  });
  EXPECT_GE(about_them, 100);
  EXPECT_LT(about_them, kClients);
  EXPECT_NE(ended.err.find("lines about the network left out"), std::string::npos);
}

TEST_F(BrachydAccess, TheScenesLimitsAreTheServers) {
  const Scene scene = parse_scene(
      "[server]\nmax_clients = 7\nmax_clients_per_address = 3\nmax_message_bytes = 512\nmax_poses_per_s = "
      "11\n"
      "hello_timeout_ms = 101\nsilence_timeout_ms = 1502\nstall_timeout_ms = 103\n",
      "scene.toml");
  const net::ServerOptions options = server_options(scene, {}, 1);
  EXPECT_EQ(options.max_clients, 7u);
  EXPECT_EQ(options.max_clients_per_address, 3u);
  EXPECT_EQ(options.max_message_bytes, 512u);
  EXPECT_EQ(options.max_poses_per_s, 11u);
  EXPECT_EQ(options.hello_timeout.count(), 101);
  EXPECT_EQ(options.silence_timeout.count(), 1502);
  EXPECT_EQ(options.stall_timeout.count(), 103);
  EXPECT_TRUE(options.tokens.is_empty());
}

TEST_F(BrachydAccess, EveryThreadGivesItsCapabilitiesUp) {
  if (!this_process_has_one()) GTEST_SKIP() << "skipped: there is no capability to give up: run as root";
  RunningBrachyd brachyd(scene("[realtime]\nfifo_priority = 10\nlock_memory = true\ncontrol_thread = true\n"
                               "[engine]\nthreads = 2\n"),
                         {"--http-port", "0", "--igtl-port", "0"});
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.port));
  ASSERT_TRUE(viewer.until([&] { return !viewer.frames.empty(); }));
  constexpr std::size_t kThreads = 6;  // io, deformation, snapshot, dose, control, worker
  ASSERT_TRUE(viewer.until([&] {
    const auto threads = threads_of(brachyd.process.pid());
    return threads.size() >= kThreads && std::ranges::all_of(threads, has_no_capability);
  }));
  const auto is_fifo = [](const ThreadStatus& status) {
    return status.at("policy") == std::to_string(SCHED_FIFO);
  };
  ASSERT_TRUE(brachyd.process.says("real time: SCHED_FIFO"));
  const auto fifo_threads = std::ranges::count_if(threads_of(brachyd.process.pid()), is_fifo);
  // Threads and memory can still be created, and new threads have no capabilities.
  Peer desk(net::Role::kOperator);
  ASSERT_TRUE(desk.join(brachyd.port));
  net::ControlMessage other;
  other.action = net::ControlAction::kModel;
  other.kernel = "psi32";
  desk.client.control(other);
  ASSERT_TRUE(desk.until([&] {
    viewer.poll();
    return !desk.states.empty() && desk.states.back().controls.kernel == "psi32";
  }));
  EXPECT_TRUE(std::ranges::all_of(threads_of(brachyd.process.pid()), has_no_capability));
  brachyd.process.send_signal(SIGTERM);
  const Ended ended = brachyd.process.wait();
  EXPECT_TRUE(exited(ended, 0));
  const bool is_granted = ended.err.find("priority 10 granted") != std::string::npos;
  EXPECT_EQ(fifo_threads, is_granted ? 2 : 0) << "the deformation thread and the idle one beside it";
}

TEST_F(BrachydAccess, ASessionIsRecordedToItsEndWithoutCapabilities) {
  folder.write("plan.toml",
               "name = \"one\"\nsource = \"6711\"\nair_kerma_strength_u = 0.5\nprescription_gy = 145\n"
               "base_plane_mm = 82\n[[needle]]\nhole = \"H7\"\nretraction_mm = 2\ntrain = \"s-s-s\"\n");
  const std::string motion = folder.write("motion.csv", short_insertion(0.3));
  RunningBrachyd brachyd(scene("[plan]\nfile = \"plan.toml\"\n"),
                         {"--session", (folder / "s/deep").string()});
  ASSERT_TRUE(exited(run_brachy({"replay", motion, "--connect", brachyd.address}), 0));
  brachyd.process.send_signal(SIGTERM);
  EXPECT_TRUE(exited(brachyd.process.wait(), 0));
  EXPECT_GT(lines_of(read_file(folder / "s/deep/poses.csv")).size(), 10u);
  EXPECT_NE(read_file(folder / "s/deep/report.html"), "");
}

TEST_F(BrachydAccess, AFolderThatRootCouldNotWriteWithoutCapabilitiesIsRefusedAtTheStart) {
  const std::string theirs = (folder / "theirs").string();
  ASSERT_EQ(::mkdir(theirs.c_str(), 0755), 0);
  if (::chown(theirs.c_str(), 12345, static_cast<gid_t>(-1)) != 0)
    GTEST_SKIP() << "only root gives files away";
  const Ended ended = run_brachyd({"--config", scene(""), "--session", theirs, "--duration", "1"});
  EXPECT_TRUE(exited(ended, 2));
  EXPECT_NE(ended.err.find("theirs"), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace brachy
