#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <csignal>
#include <cstring>

#include "apps/forces/force_log.h"
#include "haptics/trajectory/needle_trajectories.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"

namespace brachy {
namespace {

using namespace test;

struct Tools : ::testing::Test {
  TempFolder folder;
  // Poses that are late because the machine is busy are not stale.
  std::string scene = folder.write("scene.toml", small_scene("[device]\nstale_pose_ms = 60000\n"));
  std::string trajectory = folder.write("t.csv", short_insertion(4));
};

std::string closed_port() {
  boost::asio::io_context io;
  const boost::asio::ip::tcp::acceptor acceptor(io, {boost::asio::ip::make_address("127.0.0.1"), 0});
  return "127.0.0.1:" + std::to_string(acceptor.local_endpoint().port());
}

// Waits until the daemon serves `viewers` viewers, the asking peer among them.
bool wait_for_viewers(Peer& peer, std::uint32_t viewers) {
  return peer.until([&] { return peer.refresh_state() && peer.states.back().viewers == viewers; });
}

Ended interrupted(ChildProcess& process) {
  process.send_signal(SIGINT);
  return process.wait();
}

// The values of `attribute` in every `<element …>` of an XML text, in order.
std::vector<std::string> attributes_of(const std::string& xml, const std::string& element,
                                       const std::string& attribute) {
  std::vector<std::string> values;
  const std::string opening = "<" + element + " ", key = " " + attribute + "=\"";
  for (auto at = xml.find(opening); at != std::string::npos; at = xml.find(opening, at + 1)) {
    const std::string tag = xml.substr(at, xml.find('>', at) - at);
    const auto value = tag.find(key);
    if (value == std::string::npos) continue;
    const auto from = value + key.size();
    values.push_back(tag.substr(from, tag.find('"', from) - from));
  }
  return values;
}

std::uint64_t number_of(const std::string& xml, const std::string& element, const std::string& attribute) {
  const auto values = attributes_of(xml, element, attribute);
  return values.size() == 1 ? std::stoull(values[0]) : 0;
}

// Header and appended blocks of a .vtp against each other; returns its point count.
std::uint64_t check_vtp(const std::filesystem::path& file) {
  const std::string text = read_file(file);
  const auto data = text.find("<AppendedData encoding=\"raw\">\n_");
  if (data == std::string::npos) {
    ADD_FAILURE() << "no appended data";
    return 0;
  }
  const std::string header = text.substr(0, data);
  EXPECT_NE(header.find("type=\"PolyData\""), std::string::npos);
  EXPECT_NE(header.find("byte_order=\"LittleEndian\" header_type=\"UInt64\""), std::string::npos);
  const std::uint64_t points = number_of(header, "Piece", "NumberOfPoints");
  const std::uint64_t verts = number_of(header, "Piece", "NumberOfVerts");
  const std::uint64_t polys = number_of(header, "Piece", "NumberOfPolys");
  const std::uint64_t expected[] = {12 * points, 12 * points, 4 * verts, 4 * verts,
                                    12 * polys,  4 * polys,   4,         8};

  // Each array's offset leads to a byte count, and the next array begins where its bytes end.
  const std::size_t begin = data + std::strlen("<AppendedData encoding=\"raw\">\n_");
  std::vector<std::uint64_t> offsets;
  for (const std::string& offset : attributes_of(header, "DataArray", "offset"))
    offsets.push_back(std::stoull(offset));
  std::sort(offsets.begin(), offsets.end());
  EXPECT_EQ(offsets.size(), std::size(expected));
  if (offsets.size() != std::size(expected)) return 0;
  std::uint64_t at = 0;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    EXPECT_EQ(offsets[i], at);
    if (begin + at + 8 > text.size()) {
      ADD_FAILURE() << "cut off";
      return 0;
    }
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, text.data() + begin + at, sizeof bytes);
    EXPECT_EQ(bytes, expected[i]) << "array " << i;
    at += 8 + bytes;
  }
  EXPECT_EQ(text.substr(begin + at), "\n</AppendedData>\n</VTKFile>\n");
  return points;
}

TEST_F(Tools, RunEndToEndAgainstOneDaemon) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  const std::string out = (folder / "recording").string();
  ChildProcess watch(brachy_line({"watch", "--connect", daemon.address, "--json"}));
  ChildProcess full_watch(brachy_line({"watch", "--connect", daemon.address, "--full", "--json"}));
  ChildProcess record(brachy_line({"record", "--connect", daemon.address, "--out", out, "--json"}));
  Peer peer;
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(wait_for_viewers(peer, 4));
  const Ended replay =
      run_brachy({"replay", trajectory, "--connect", daemon.address, "--speed", "2", "--json"});
  ASSERT_TRUE(
      peer.until([&] { return !peer.frames.empty() && peer.needle().contact == ContactState::kWithdrawn; }));
  const Ended watched = interrupted(watch), watched_full = interrupted(full_watch),
              recorded = interrupted(record);
  daemon.process.send_signal(SIGTERM);
  const Ended ended = daemon.process.wait();
  ASSERT_TRUE(exited(replay, 0));
  ASSERT_TRUE(exited(watched, 0));
  ASSERT_TRUE(exited(watched_full, 0));
  ASSERT_TRUE(exited(recorded, 0));
  ASSERT_TRUE(exited(ended, 0));

  const auto daemons = json_of(ended), replays = json_of(replay), records = json_of(recorded);
  ASSERT_FALSE(daemons.is_discarded() || replays.is_discarded() || records.is_discarded());
  const double largest = daemons.at("max_disp_mm");
  EXPECT_GT(largest, 0.5);
  EXPECT_LT(largest, 10);

  EXPECT_GT(replays.at("poses_sent").get<int>(), 20);
  EXPECT_EQ(replays.at("poses_accepted"), replays.at("poses_sent"));
  EXPECT_EQ(replays.at("poses_refused"), 0);
  EXPECT_EQ(daemons.at("poses_accepted"), replays.at("poses_sent"));
  EXPECT_DOUBLE_EQ(replays.at("duration_s"), 2);
  EXPECT_GT(replays.at("max_disp_mm").get<double>(), 0.5);
  EXPECT_GT(replays.at("max_depth_mm").get<double>(), 10);
  EXPECT_GT(replays.at("round_trip_ms").at("p50").get<double>(), 0);

  for (const Ended* w : {&watched, &watched_full}) {
    const auto json = json_of(*w);
    ASSERT_FALSE(json.is_discarded()) << w->out;
    EXPECT_EQ(lines_of(w->out).size(), 1u) << w->out;
    EXPECT_GT(json.at("ticks").get<double>(), 50);
    EXPECT_LE(json.at("ticks").get<double>(), daemons.at("ticks").get<double>());
    EXPECT_LE(json.at("overruns").get<double>(), daemons.at("overruns").get<double>());
    EXPECT_GT(json.at("sim_hz").get<double>(), 20);
    EXPECT_LT(json.at("sim_hz").get<double>(), 202);
    EXPECT_GT(json.at("snapshots_hz").get<double>(), 3);
    EXPECT_LT(json.at("snapshots_hz").get<double>(), 33);
    const auto &tick = json.at("tick_ms"), &latency = json.at("latency_ms");
    EXPECT_GT(tick.at("p50").get<double>(), 0);
    EXPECT_LE(tick.at("p50").get<double>(), tick.at("p99").get<double>());
    EXPECT_LE(tick.at("p99").get<double>(), tick.at("max").get<double>());
    EXPECT_GT(latency.at("p50").get<double>(), 0);
    EXPECT_LE(latency.at("p50").get<double>(), latency.at("p99").get<double>());
    // A gap in the sequence is a snapshot that was dropped for this client, and nothing else.
    EXPECT_EQ(json.at("seq_gaps"), json.at("drops"));
    EXPECT_GT(json.at("max_disp_mm").get<double>(), 0.5);
    EXPECT_LE(json.at("max_disp_mm").get<double>(), largest);
    EXPECT_GT(json.at("moved").get<int>(), 100);
    EXPECT_LE(json.at("moved").get<int>(), daemons.at("moved").get<int>());
  }
  EXPECT_EQ(json_of(watched).at("seq_gaps"), 0);
  EXPECT_GT(json_of(watched_full).at("bytes").get<double>(), json_of(watched).at("bytes").get<double>());

  EXPECT_EQ(records.at("seq_gaps"), 0);
  EXPECT_EQ(records.at("ticks_missed"), 0);
  const std::string index = read_file(folder / "recording/recording.pvd");
  const auto times = attributes_of(index, "DataSet", "timestep"),
             files = attributes_of(index, "DataSet", "file");
  const std::size_t steps = files.size();
  ASSERT_EQ(times.size(), steps);
  for (std::size_t i = 0; i < steps; ++i) {
    EXPECT_GT(std::stod(times[i]), i ? std::stod(times[i - 1]) : 0);
    const auto file = folder / ("recording/" + files[i]);
    ASSERT_TRUE(std::filesystem::exists(file)) << file;
    EXPECT_EQ(check_vtp(file), 3000u) << file;
  }
  EXPECT_GT(steps, 10u);
  EXPECT_EQ(records.at("snapshots"), steps);
  EXPECT_TRUE(index.ends_with("</Collection>\n</VTKFile>\n"));

  // The pose log has every tick's pose, so that the run can be repeated offline.
  const Trajectory log = load_trajectory(folder / "recording/poses.csv");
  const auto ticks = static_cast<std::size_t>(std::lround(log.duration_s() / 0.005)) + 1;
  EXPECT_EQ(records.at("poses"), ticks);
  EXPECT_LE(log.samples().size(), ticks);
  // The force log: a row a snapshot once there is a needle, as a replay's.
  const std::vector<ForceSample> forces = load_force_log(folder / "recording/forces.csv");
  EXPECT_EQ(records.at("forces"), forces.size());
  EXPECT_GT(forces.size(), 10u);
  EXPECT_LE(forces.size(), steps);
  double deepest = 0;
  for (const ForceSample& row : forces) {
    EXPECT_EQ(row.needle, 0u);
    EXPECT_NEAR(row.forces.axial_n, row.forces.cutting_n + row.forces.friction_n, 1e-9) << row.t_s;
    EXPECT_GE(row.t_s, log.start_s() - 1e-9);
    EXPECT_LE(row.t_s, log.end_s() + 1e-9);
    EXPECT_LE(row.min_det, 1) << row.t_s;
    deepest = std::max(deepest, row.depth_mm);
  }
  EXPECT_GT(deepest, 10);
  EXPECT_EQ(forces.back().state, ContactState::kWithdrawn);
  EXPECT_TRUE(exited(run_brachy({"plot-force", out + "/forces.csv"}), 0));

  const Ended again = run_brachy({"replay", out + "/poses.csv", "--offline", "--config", scene, "--json"});
  ASSERT_TRUE(exited(again, 0));
  EXPECT_EQ(json_of(again).at("ticks"), ticks);
  EXPECT_NEAR(json_of(again).at("max_disp_mm").get<double>(), largest, 1e-6);
  EXPECT_EQ(json_of(again).at("moved"), daemons.at("moved"));
  EXPECT_EQ(json_of(again).at("contact"), "withdrawn");
}

// A device for each needle on one clock; the recording has the needle of each pose and force.
TEST_F(Tools, SeveralNeedlesArePlayedAndRecorded) {
  const std::string three =
      folder.write("three.toml", small_scene("[needle]\ncount = 3\n[device]\nstale_pose_ms = 60000\n"));
  RunningBrachyd daemon(three);
  ASSERT_NE(daemon.port, 0);
  const std::string out = (folder / "r").string();
  ChildProcess record(
      brachy_line({"record", "--connect", daemon.address, "--surface", "--out", out, "--json"}));
  Peer peer;
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(wait_for_viewers(peer, 2));
  const Ended replay = run_brachy({"replay", (kConfigFolder / "insertion_three_needles.csv").string(),
                                   "--connect", daemon.address, "--speed", "8", "--json"});
  ASSERT_TRUE(exited(replay, 0));
  ASSERT_TRUE(
      peer.until([&] { return !peer.frames.empty() && peer.needle().contact == ContactState::kWithdrawn; }));
  const Ended recorded = interrupted(record);
  daemon.process.send_signal(SIGTERM);
  ASSERT_TRUE(exited(daemon.process.wait(), 0));
  ASSERT_TRUE(exited(recorded, 0));
  EXPECT_EQ(json_of(replay).at("needles"), 3);
  EXPECT_EQ(json_of(replay).at("poses_accepted"), json_of(replay).at("poses_sent"));

  const NeedleTrajectories poses = load_trajectories(out + "/poses.csv");
  ASSERT_EQ(poses.needles().size(), 3u);
  EXPECT_GT(poses.needles()[2].motion.start_s(), poses.needles()[1].motion.start_s());
  EXPECT_GT(poses.needles()[0].motion.start_s(), poses.needles()[2].motion.start_s());
  EXPECT_NEAR(poses.needles()[1].motion.samples().back().X_WN.p.x(), -10, 1e-6);
  EXPECT_NEAR(poses.needles()[2].motion.samples().back().X_WN.p.x(), 10, 1e-6);
  std::array<ContactState, 3> last{};
  for (const ForceSample& row : load_force_log(out + "/forces.csv")) {
    ASSERT_LT(row.needle, 3u);
    last[row.needle] = row.state;
  }
  EXPECT_EQ(last, (std::array{ContactState::kWithdrawn, ContactState::kInserted, ContactState::kInserted}));
  const auto again =
      json_of(run_brachy({"replay", out + "/poses.csv", "--offline", "--config", three, "--json"}));
  ASSERT_FALSE(again.is_discarded());
  EXPECT_EQ(again.at("needles").size(), 3u);
  EXPECT_EQ(again.at("needles")[0].at("contact"), "withdrawn");
  EXPECT_EQ(again.at("needles")[1].at("contact"), "inserted");
}

TEST_F(Tools, ANeedleThatTheDaemonHasNotIsAFailureThatNamesIt) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  const Ended replay = run_brachy(
      {"replay", (kConfigFolder / "insertion_three_needles.csv").string(), "--connect", daemon.address});
  EXPECT_TRUE(exited(replay, 1));
  EXPECT_TRUE(replay.err.starts_with("brachy replay: needle ")) << replay.err;
  EXPECT_NE(replay.err.find("raise needle.count"), std::string::npos) << replay.err;
}

TEST_F(Tools, WatchAndRecordEndAfterTheirDuration) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  const std::string out = (folder / "new/folder").string();
  ChildProcess watch(brachy_line({"watch", "--connect", daemon.address, "--duration", "0.4"}));
  ChildProcess record(
      brachy_line({"record", "--connect", daemon.address, "--out", out, "--duration", "0.4", "--json"}));
  const Ended watched = watch.wait(), recorded = record.wait();
  EXPECT_TRUE(exited(watched, 0));
  EXPECT_NE(watched.out.find("watch: "), std::string::npos) << watched.out;
  EXPECT_EQ(watched.err, "");
  EXPECT_TRUE(exited(recorded, 0));
}

TEST_F(Tools, WatchAndRecordEndWellWhenTheDaemonStops) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  const std::string out = (folder / "r").string();
  ChildProcess watch(brachy_line({"watch", "--connect", daemon.address, "--json"}));
  ChildProcess record(brachy_line({"record", "--connect", daemon.address, "--out", out, "--json"}));
  Peer peer;
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(wait_for_viewers(peer, 3));
  const std::size_t frames = peer.frames.size();
  ASSERT_TRUE(peer.until([&] { return peer.frames.size() > frames + 2; }));
  daemon.process.send_signal(SIGTERM);
  ASSERT_TRUE(exited(daemon.process.wait(), 0));
  const Ended watched = watch.wait(), recorded = record.wait();
  EXPECT_TRUE(exited(watched, 0));
  EXPECT_FALSE(json_of(watched).is_discarded());
  ASSERT_TRUE(exited(recorded, 0));
  EXPECT_EQ(json_of(recorded).at("poses"), 0) << "there was no needle";
  EXPECT_GT(json_of(recorded).at("snapshots").get<int>(), 0);
}

TEST_F(Tools, AKilledDaemonIsAFailure) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  ChildProcess watch(brachy_line({"watch", "--connect", daemon.address, "--json"}));
  ChildProcess replay(brachy_line({"replay", trajectory, "--connect", daemon.address, "--loop"}));
  Peer peer;
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(wait_for_viewers(peer, 2));
  ASSERT_TRUE(peer.until([&] { return peer.refresh_state() && peer.states.back().poses_accepted > 0; }));
  daemon.process.send_signal(SIGKILL);
  EXPECT_EQ(daemon.process.wait().signal, SIGKILL);
  const Ended watched = watch.wait(), replayed = replay.wait();
  EXPECT_TRUE(exited(watched, 1));
  EXPECT_NE(watched.err.find("brachy watch: "), std::string::npos) << watched.err;
  EXPECT_TRUE(exited(replayed, 1));
  EXPECT_NE(replayed.err.find("brachy replay: "), std::string::npos) << replayed.err;
}

TEST_F(Tools, AReplayCutShortByTheDaemonIsAFailure) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  ChildProcess replay(
      brachy_line({"replay", trajectory, "--connect", daemon.address, "--speed", "0.1", "--json"}));
  Peer peer;
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(peer.until([&] { return peer.refresh_state() && peer.states.back().poses_accepted > 0; }));
  daemon.process.send_signal(SIGTERM);
  ASSERT_TRUE(exited(daemon.process.wait(), 0));
  const Ended replayed = replay.wait();
  EXPECT_TRUE(exited(replayed, 1));
  EXPECT_EQ(lines_of(replayed.err).size(), 1u) << replayed.err;
  EXPECT_NE(replayed.err.find("before the trajectory's end"), std::string::npos) << replayed.err;
}

TEST_F(Tools, RecordOverwritesNothing) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  const auto record = [&](const std::string& name) {
    return run_brachy(
        {"record", "--connect", daemon.address, "--out", (folder / name).string(), "--duration", "0.1"});
  };
  for (const char* file : {"recording.pvd", "poses.csv"}) {
    const std::string name = std::string("with_") + file;
    std::filesystem::create_directory(folder / name);
    folder.write(name + "/" + file, "mine");
    EXPECT_TRUE(refused_in_one_line(record(name), {name, "nothing is overwritten"}));
    EXPECT_EQ(read_file(folder / (name + "/" + file)), "mine");
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / name), {}), 1);
  }
  EXPECT_TRUE(refused_in_one_line(record("t.csv"), {"t.csv"}));  // a file where the folder should be
  ASSERT_TRUE(exited(record("twice"), 0));
  const std::string index = read_file(folder / "twice/recording.pvd");
  EXPECT_TRUE(refused_in_one_line(record("twice"), {"twice"}));
  EXPECT_EQ(read_file(folder / "twice/recording.pvd"), index);
}

TEST_F(Tools, AClosedPortIsRefusedInOneLine) {
  const std::string port = closed_port();
  EXPECT_TRUE(refused_in_one_line(run_brachy({"watch", "--connect", port}), {port}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"replay", trajectory, "--connect", port}), {port}));
  const std::string out = (folder / "r").string();
  EXPECT_TRUE(refused_in_one_line(run_brachy({"record", "--connect", port, "--out", out}), {port}));
  // Nothing prevents another attempt.
  EXPECT_FALSE(std::filesystem::exists(folder / "r/poses.csv"));
}

TEST_F(Tools, ASecondReplayIsToldWhoHoldsTheLease) {
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  ChildProcess first(brachy_line({"replay", trajectory, "--connect", daemon.address, "--loop", "--json"}));
  Peer peer;
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(peer.until([&] { return peer.refresh_state() && peer.states.back().poses_accepted > 0; }));
  const Ended second = run_brachy({"replay", trajectory, "--connect", daemon.address});
  EXPECT_TRUE(exited(second, 1));
  EXPECT_EQ(second.out, "");
  EXPECT_EQ(lines_of(second.err).size(), 1u) << second.err;
  EXPECT_NE(second.err.find(peer.states.back().device_holder), std::string::npos) << second.err;
  EXPECT_NE(second.err.find("brachy replay (127.0.0.1:"), std::string::npos) << second.err;

  const Ended ended = interrupted(first);
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_GT(json_of(ended).at("poses_accepted").get<int>(), 0);
}

TEST_F(Tools, SayWhatIsWrongWithAnAddressOrACommand) {
  const auto said = [](const Ended& ended, const std::string& what) {
    return exited(ended, 2) && ended.err.find(what) != std::string::npos
               ? ::testing::AssertionSuccess()
               : ::testing::AssertionFailure() << ended.err << " does not say " << what;
  };
  EXPECT_TRUE(said(run_brachy({"wacth"}), "there is no command 'wacth'; did you mean 'watch'?"));
  EXPECT_TRUE(said(run_brachyd({"dcotor"}), "did you mean 'doctor'?"));
  EXPECT_TRUE(said(run_brachyd({"my.toml"}), "a scene file comes after --config: --config my.toml"));
  EXPECT_TRUE(said(run_brachyd({"--port", "abc"}), "needs a whole number, not 'abc'"));
  EXPECT_TRUE(
      said(run_brachy({"replay", trajectory, "--offline", "--speed", "abc"}), "needs a number, not 'abc'"));
  EXPECT_TRUE(said(run_brachy({"watch", "--connect", "http://127.0.0.1:18951"}), "for a browser"));
  EXPECT_TRUE(
      said(run_brachy({"watch", "--connect", "::1:18950"}), "an IPv6 address in brackets: [::1]:18950"));
  EXPECT_TRUE(said(run_brachy({"watch", "--connect", "[::1]:1"}), "nothing listens on"))
      << "the address is read";
  EXPECT_TRUE(said(run_brachyd({"--config", "/tmp"}), "is a folder; name the scene file in it"));
}

TEST_F(Tools, AMistypedOptionGetsASuggestion) {
  const auto says = [](const Ended& ended, const std::string& what) {
    EXPECT_TRUE(exited(ended, 2));
    EXPECT_NE(ended.err.find(what), std::string::npos) << ended.err;
  };
  says(run_brachyd({"--prot", "0"}), "did you mean '--port'?");
  says(run_brachyd({"--htpp-port=0"}), "did you mean '--http-port'?");
  says(run_brachyd({"doctor", "--secnds", "1"}), "did you mean '--seconds'?");
  says(run_brachy({"watch", "--conect", "127.0.0.1:1"}), "did you mean '--connect'?");
  const Ended nothing_near = run_brachyd({"--completely-other"});
  EXPECT_TRUE(exited(nothing_near, 2));
  EXPECT_EQ(nothing_near.err.find("did you mean"), std::string::npos) << nothing_near.err;
}

TEST_F(Tools, AFileOfAnotherKindIsNamedWithWhatToGive) {
  const std::string config = kConfigFolder.string() + "/", exercise = config + "exercises/01_one_needle.toml";
  const auto says = [](const Ended& ended, const std::string& what) {
    EXPECT_TRUE(refused_in_one_line(ended, {what}));
  };
  says(run_brachyd({"--check-config", exercise}),
       "01_one_needle.toml is an exercise; a scene is asked for here: " + config +
           "exercises/scenes/01_one_needle.toml");
  says(run_brachyd({"--check-config", config + "plan.toml"}),
       "plan.toml is a plan of seeds; a scene is asked for here");
  says(run_brachyd({"--check-config", config + "hdr_plan.toml"}),
       "is a plan of HDR catheters; a scene is asked for");
  says(run_brachyd({"--check-config", config + "sources/6711.toml"}), "6711.toml is a seed source; a scene");
  says(run_brachyd({"--check-config", config + "insertion.csv"}),
       "insertion.csv is a trajectory; a scene is asked for");
  says(run_brachy({"score", folder.write("session.txt", ""), "--exercise",
                   config + "exercises/scenes/01_one_needle.toml"}),
       "is a scene; an exercise is asked for here");
  says(run_brachy({"replay", config + "plan.toml", "--offline"}),
       "plan.toml is a plan of seeds; a trajectory is asked for");
  says(run_brachy({"inspect", config + "plan.toml"}),
       "plan.toml is a plan of seeds; a scene is asked for here");
  says(run_brachy({"inspect", folder.write("there.txt", "") + ".nosuch"}), "there.txt.nosuch: no such file");
  const std::string with_exercise =
      folder.write("with_exercise.toml", "[plan]\nfile = \"" + exercise + "\"\n");
  says(run_brachyd({"--check-config", with_exercise}),
       "01_one_needle.toml is an exercise; a plan of seeds is asked for here");
}

TEST_F(Tools, AFileInAnotherDialectIsNamed) {
  const std::string semicolons = folder.write("s.csv", "t_s;m00;m01\n0;1;0\n");
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"replay", semicolons, "--offline"}), {"s.csv:1", "semicolons"}));
  const std::string top = folder.write("top.toml", "deformation_hz = 100\n");
  EXPECT_TRUE(refused_in_one_line(run_brachyd({"--check-config", top}),
                                  {"top.toml:1", "'deformation_hz' belongs into the table [rates]"}));
}

TEST_F(Tools, RefuseWrongUsageWithTwo) {
  for (const std::vector<std::string>& line : std::vector<std::vector<std::string>>{
           {},
           {"dance"},
           {"watch"},
           {"watch", "--connect", "18950"},
           {"watch", "--connect", "127.0.0.1:0"},
           {"watch", "--connect", "127.0.0.1:70000"},
           {"watch", "--connect", "127.0.0.1:1", "--duration", "nan"},
           {"record", "--connect", "127.0.0.1:1"},
           {"replay", "--connect", "127.0.0.1:1"},
           {"replay", trajectory, "--connect", "127.0.0.1:1", "--rate-hz", "0"},
           {"replay", trajectory, "--offline", "--speed", "nan"},
           {"plot-force"},
           {"plot-force", "none.csv"},
           {"plot-force", trajectory},
           {"plot-force", trajectory, "--needle", "16"},
           {"replay", trajectory, "--offline", "--translate-mm", "1,2"},
           {"replay", trajectory, "--offline", "--translate-mm", "1,2,nan"}}) {
    const Ended ended = run_brachy(line);
    EXPECT_TRUE(exited(ended, 2)) << (line.empty() ? "nothing" : line.back());
    EXPECT_EQ(ended.out, "");
    EXPECT_FALSE(ended.err.empty());
  }
}

}  // namespace
}  // namespace brachy
