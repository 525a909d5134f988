#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <csignal>

#include "core/base/simd/simd_target.h"
#include "core/base/version.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"

namespace brachy {
namespace {

using namespace test;

struct Brachyd : ::testing::Test {
  TempFolder folder;
  std::string scene = folder.write("scene.toml", small_scene());

  Ended check_config(const std::string& text) {
    return run_brachyd({"--check-config", folder.write("checked.toml", text)});
  }
};

TEST_F(Brachyd, SaysItsAddressThenRunsForItsDurationAndSumsUp) {
  RunningBrachyd daemon(scene, {"--duration", "0.6"});
  ASSERT_NE(daemon.port, 0);
  const Ended ended = daemon.process.wait();
  ASSERT_TRUE(exited(ended, 0));

  // Standard output has the address and the summary, nothing else: logs go to stderr.
  const auto lines = lines_of(ended.out);
  ASSERT_EQ(lines.size(), 2u) << ended.out;
  const std::string address = "127.0.0.1:" + std::to_string(daemon.port);
  EXPECT_EQ(nlohmann::json::parse(lines[0]), (nlohmann::json{{"listening_on", address}}));
  EXPECT_NE(ended.err.find("tissue: 3000 points"), std::string::npos) << ended.err;
  const auto json = json_of(ended);
  ASSERT_FALSE(json.is_discarded()) << lines[1];
  const double elapsed_s = json.at("elapsed_s");
  EXPECT_GE(elapsed_s, 0.6);
  EXPECT_GT(json.at("ticks").get<int>(), 0);
  // Deadlines are on a grid of 5 ms: each was met or missed, and none was run late.
  EXPECT_LE(json.at("ticks").get<double>() + json.at("overruns").get<double>(), elapsed_s * 200 + 1);
  EXPECT_GT(json.at("snapshots").get<int>(), 0);
  EXPECT_LE(json.at("snapshots").get<double>(), elapsed_s * 30 + 1);
  for (const char* quantiles : {"tick_ms", "lateness_ms"}) {
    const auto& q = json.at(quantiles);
    EXPECT_GT(q.at("p50").get<double>(), 0) << quantiles;
    EXPECT_LE(q.at("p50").get<double>(), q.at("p99").get<double>()) << quantiles;
    EXPECT_LE(q.at("p99").get<double>(), q.at("p999").get<double>()) << quantiles;
  }
  EXPECT_EQ(json.at("max_disp_mm"), 0);
  EXPECT_EQ(json.at("moved"), 0);
  // At rest every tick is certified, and the guard does nothing.
  EXPECT_EQ(json.at("ticks_injective"), json.at("ticks"));
  EXPECT_EQ(json.at("ticks_substepped"), 0);
  EXPECT_EQ(json.at("min_det_bound"), 1);
  EXPECT_EQ(json.at("nonfinite"), 0);
  EXPECT_LE(json.at("longest_overrun").get<int>(), json.at("overruns").get<int>());
  EXPECT_EQ(json.at("poses_accepted"), 0);
  EXPECT_EQ(json.at("control_ticks"), 0);
  EXPECT_FALSE(json.at("realtime").get<std::string>().empty());
}

TEST_F(Brachyd, ReportsWhatEachIntervalDid) {
  RunningBrachyd daemon(scene, {"--report-every", "0.2"});
  double last_s = 0, ticks = 0;
  for (int intervals = 0; intervals < 2 || ticks == 0; ++intervals) {
    const auto line = daemon.process.read_line();
    ASSERT_TRUE(line);
    const auto interval = nlohmann::json::parse(*line);
    EXPECT_GE(interval.at("interval_end_s").get<double>(), last_s + 0.2);
    last_s = interval.at("interval_end_s");
    ticks += interval.at("ticks").get<double>();
    EXPECT_LE(interval.at("tick_ms").at("p50").get<double>(), interval.at("tick_ms").at("max").get<double>());
  }
  daemon.process.send_signal(SIGTERM);
  const Ended ended = daemon.process.wait();
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_LE(ticks, json_of(ended).at("ticks").get<double>());
}

TEST_F(Brachyd, WithoutJsonItWritesItsAddressOnly) {
  const Ended ended = run_brachyd({"--config", scene, "--port", "0", "--duration", "0.1"});
  ASSERT_TRUE(exited(ended, 0));
  ASSERT_EQ(lines_of(ended.out).size(), 1u) << ended.out;
  EXPECT_TRUE(ended.out.starts_with("brachyd listening on 127.0.0.1:")) << ended.out;
  EXPECT_NE(ended.err.find("missed"), std::string::npos) << ended.err;
}

TEST_F(Brachyd, TheControlThreadCountsTheMachinesOwnMisses) {
  const Ended ended =
      run_brachyd({"--config", scene, "--port", "0", "--duration", "0.3", "--control-thread", "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_GT(json_of(ended).at("control_ticks").get<int>(), 0);
}

class BrachydSignal : public Brachyd, public ::testing::WithParamInterface<int> {};

// How soon: scripts/campaigns/faults.sh sigterm start-stop.
TEST_P(BrachydSignal, EndsIt) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  // Right after its first line: an early signal is not lost.
  daemon.process.send_signal(GetParam());
  const Ended ended = daemon.process.wait();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_FALSE(json_of(ended).is_discarded());
}

TEST_P(BrachydSignal, EndsItWithAViewerAndADeviceConnected) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  Peer viewer, device(net::Role::kDevice), silent_viewer(net::Role::kViewer, net::kSubscribeFullFrames);
  ASSERT_TRUE(viewer.join(daemon.port));
  ASSERT_TRUE(device.join(daemon.port));
  ASSERT_TRUE(silent_viewer.join(daemon.port));  // and reads no more
  RigidTransform X_WN;
  X_WN.p = Vec3(8, -4, -40);
  ASSERT_TRUE(device.show(X_WN));

  daemon.process.send_signal(GetParam());
  const Ended ended = daemon.process.wait();
  EXPECT_TRUE(exited(ended, 0));
  ASSERT_TRUE(viewer.until([&] { return !viewer.closed.empty(); }));
  ASSERT_FALSE(viewer.errors.empty());
  EXPECT_EQ(viewer.errors.back().code, net::ErrorCode::kShutdown);
  EXPECT_EQ(json_of(ended).at("poses_accepted"), 1);
}

INSTANTIATE_TEST_SUITE_P(InterruptAndTerminate, BrachydSignal, ::testing::Values(SIGINT, SIGTERM),
                         [](const auto& number) { return number.param == SIGINT ? "Int" : "Term"; });

TEST_F(Brachyd, RefusesAPortInUseAndNamesIt) {
  boost::asio::io_context io;
  const boost::asio::ip::tcp::acceptor taken(io, {boost::asio::ip::make_address("127.0.0.1"), 0});
  const std::string port = std::to_string(taken.local_endpoint().port());
  const Ended ended = run_brachyd({"--config", scene, "--port", port});
  ASSERT_TRUE(exited(ended, 2));
  EXPECT_EQ(ended.out, "");
  EXPECT_NE(lines_of(ended.err).back().find(port), std::string::npos) << ended.err;
  EXPECT_NE(lines_of(ended.err).back().find("in use"), std::string::npos) << ended.err;
}

TEST_F(Brachyd, AFinishedDaemonLeavesItsPortFree) {
  RunningBrachyd first(scene);
  ASSERT_NE(first.port, 0);
  Peer viewer;
  ASSERT_TRUE(viewer.join(first.port));
  first.process.send_signal(SIGTERM);
  ASSERT_TRUE(exited(first.process.wait(), 0));
  const Ended second =
      run_brachyd({"--config", scene, "--port", std::to_string(first.port), "--duration", "0.05"});
  EXPECT_TRUE(exited(second, 0));
}

TEST_F(Brachyd, RefusesAnAddressThatIsNotLoopback) {
  const std::string remote = folder.write("r.toml", small_scene("address = \"0.0.0.0\"\n"));
  const Ended ended = run_brachyd({"--config", remote});
  ASSERT_TRUE(exited(ended, 2));
  EXPECT_EQ(ended.out, "");
  EXPECT_NE(ended.err.find("--insecure-allow-remote"), std::string::npos) << ended.err;
  EXPECT_NE(ended.err.find("0.0.0.0"), std::string::npos) << ended.err;
  EXPECT_TRUE(exited(check_config(small_scene("address = \"0.0.0.0\"\n")), 2));
  EXPECT_TRUE(exited(check_config(small_scene("address = \"prostate\"\n")), 2));
}

TEST_F(Brachyd, CheckConfigSaysOkToEveryShippedScene) {
  int scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(kConfigFolder)) {
    const bool is_plan = entry.path().stem().string().ends_with("plan");
    if (entry.path().extension() != ".toml" || is_plan) continue;
    ++scenes;
    const std::string file = entry.path().string();
    const Ended ended = run_brachyd({"--check-config", file});
    EXPECT_TRUE(exited(ended, 0)) << ended.err;
    EXPECT_EQ(ended.out, file + ": ok\n");
  }
  EXPECT_GE(scenes, 4);
}

TEST_F(Brachyd, CheckConfigDoesNotNeedThePort) {
  boost::asio::io_context io;
  const boost::asio::ip::tcp::acceptor taken(io, {boost::asio::ip::make_address("127.0.0.1"), 0});
  const std::string port = std::to_string(taken.local_endpoint().port());
  EXPECT_TRUE(exited(check_config("[server]\nport = " + port + "\n"), 0));
}

TEST_F(Brachyd, RefusesABadSceneInOneLineWithLineAndSuggestion) {
  EXPECT_TRUE(refused_in_one_line(check_config("name = \"x\"\n[rates]\ndeformation_hertz = 200\n"),
                                  {"checked.toml:3", "rates.deformation_hertz", "rates.deformation_hz"}));
  EXPECT_TRUE(refused_in_one_line(check_config("[tisue]\npoints = 1\n"), {"checked.toml:1", "'tissue'"}));
  EXPECT_TRUE(refused_in_one_line(check_config("[rates]\ndeformation_hz = 0\n"), {"checked.toml:2"}));
  EXPECT_TRUE(refused_in_one_line(check_config("[rates]\ndeformation_hz = nan\n"), {"checked.toml:2"}));
  EXPECT_TRUE(refused_in_one_line(check_config("[rates]\ndeformation_hz = \"200\"\n"), {"checked.toml:2"}));
  EXPECT_TRUE(refused_in_one_line(check_config("[rates\n"), {"checked.toml:1"}));
  EXPECT_TRUE(refused_in_one_line(check_config("[device]\nkind = \"scripted\"\n"), {"trajectory"}));
  const std::string none = (folder / "none.toml").string();
  EXPECT_TRUE(refused_in_one_line(run_brachyd({"--check-config", none}), {"none.toml"}));
  EXPECT_TRUE(refused_in_one_line(run_brachyd({"--config", none}), {"none.toml"}));
  EXPECT_TRUE(refused_in_one_line(run_brachyd({"--config", (folder / "").string()}), {}));
}

TEST_F(Brachyd, RefusesABadMeshInOneLine) {
  const std::string whole = octahedron_stl(20);
  const auto with = [&](const std::string& name, const std::string& content) {
    folder.write(name, content);
    return check_config("[tissue]\npoints = 500\nmesh = \"" + name + "\"\n[anchors]\ncount = 2\n");
  };
  EXPECT_TRUE(exited(with("good.stl", whole), 0));
  EXPECT_TRUE(refused_in_one_line(with("empty.stl", ""), {"empty.stl"}));
  EXPECT_TRUE(refused_in_one_line(with("cut.stl", whole.substr(0, whole.size() / 2)), {"cut.stl"}));
  std::string nan = whole;
  nan.replace(nan.find("vertex 20"), 9, "vertex nan");
  EXPECT_TRUE(refused_in_one_line(with("nan.stl", nan), {"nan.stl"}));
  const auto first = whole.find("facet normal"), second = whole.find("facet normal", first + 1);
  std::string open = whole;
  open.erase(first, second - first);
  EXPECT_TRUE(refused_in_one_line(with("open.stl", open), {"open.stl", "3 bad edges"}));
  EXPECT_TRUE(
      refused_in_one_line(with("bad.ply", "ply\nformat ascii 1.0\nelement vertex 999999999\n"), {"bad.ply"}));
  EXPECT_TRUE(refused_in_one_line(check_config("[tissue]\nmesh = \"none.stl\"\n"), {"none.stl"}));
}

TEST_F(Brachyd, RefusesABadTrajectoryInOneLine) {
  const std::string good = short_insertion(1);
  const auto with = [&](const std::string& name, const std::string& content) {
    folder.write(name, content);
    const Ended ended =
        check_config(small_scene("[device]\nkind = \"scripted\"\ntrajectory = \"" + name + "\"\n"));
    return ended;
  };
  // The tissue is reported before the trajectory is read.
  const auto refused_with = [](const Ended& ended, const std::string& part) {
    if (const auto code = exited(ended, 2); !code) return code;
    const auto lines = lines_of(ended.err);
    const auto own = [](const std::string& line) { return line.starts_with("brachyd: "); };
    if (std::count_if(lines.begin(), lines.end(), own) != 1 || !own(lines.back()) ||
        lines.back().find(part) == std::string::npos)
      return ::testing::AssertionFailure() << ended.err;
    return ::testing::AssertionSuccess();
  };
  EXPECT_TRUE(exited(with("good.csv", good), 0));
  EXPECT_TRUE(refused_with(with("empty.csv", ""), "empty.csv:1"));
  EXPECT_TRUE(refused_with(with("cut.csv", good.substr(0, good.size() - 20)), "cut.csv:6"));
  std::string nan = good;
  nan.replace(nan.find("-40"), 3, "nan");
  EXPECT_TRUE(refused_with(with("nan.csv", nan), "nan.csv:2"));
  EXPECT_TRUE(refused_with(
      check_config(small_scene("[device]\nkind = \"scripted\"\ntrajectory = \"none.csv\"\n")), "none.csv"));
}

TEST_F(Brachyd, RefusesWrongUsageWithTwo) {
  for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{{"--port", "70000"},
                                                                                    {"--port", "x"},
                                                                                    {"--duration", "-1"},
                                                                                    {"--duration", "nan"},
                                                                                    {"--colour"},
                                                                                    {"scene.toml"}}) {
    const Ended ended = run_brachyd(line);
    EXPECT_TRUE(exited(ended, 2)) << line[0];
    EXPECT_EQ(ended.out, "");
    EXPECT_FALSE(ended.err.empty());
  }
}

TEST_F(Brachyd, ExplainsItself) {
  const Ended help = run_brachyd({"--help"});
  EXPECT_TRUE(exited(help, 0));
  EXPECT_NE(help.out.find("--check-config"), std::string::npos);
  const Ended version = run_brachyd({"--version"});
  EXPECT_TRUE(exited(version, 0));
  EXPECT_EQ(version.out, "brachyd " + brachy::version() + ", protocol 1\n");
}

TEST_F(Brachyd, SaysWhatItIsBuiltOn) {
  const auto of = [](const Ended& ended) {
    EXPECT_TRUE(exited(ended, 0));
    return nlohmann::json::parse(ended.out);
  };
  auto daemon = of(run_brachyd({"--version", "--json"})), tools = of(run_brachy({"--version", "--json"}));
  EXPECT_EQ(daemon.at("program"), "brachyd");
  EXPECT_EQ(tools.at("program"), "brachy");
  daemon.erase("program"), tools.erase("program");
  EXPECT_EQ(daemon, tools);
  EXPECT_EQ(daemon.at("version"), brachy::version());
  EXPECT_EQ(daemon.at("protocol"), 1);
  EXPECT_NE(daemon.at("build").at("flags").get<std::string>().find("-ffp-contract=off"), std::string::npos);
  EXPECT_TRUE(find_simd_target(daemon.at("simd").at("best").get<std::string>()));
  for (const char* library :
       {"libsystemd", "Eigen", "Boost", "OpenSSL", "assimp", "CLI11", "tomlplusplus", "spdlog", "fmt"})
    EXPECT_NE(daemon.at("libraries").at(library), "") << library;
  EXPECT_EQ(daemon.at("nats").get<bool>(), daemon.at("libraries").contains("libnats"));
  EXPECT_TRUE(exited(run_brachy({"--json", "token", "x"}), 2)) << "a command has a --json of its own";
}

}  // namespace
}  // namespace brachy
