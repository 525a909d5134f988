// `brachy record`, `export`, `inspect` and `replay` of recording files, end to end.
#include <algorithm>
#include <csignal>
#include <map>

#include "apps/forces/force_log.h"
#include "apps/recording/read_recording.h"
#include "apps/recording/recorded_motion.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"
#include "test_paths.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/apps/served_states.h"

namespace brachy {
namespace {

using namespace test;

struct RecordingTools : ::testing::Test {
  std::string path(const std::string& name) const { return (folder / name).string(); }
  TempFolder folder;
};

/// The mesh after each FRAME of a recording, by tick, and its TOPOLOGY as it came.
struct RecordedMeshes {
  explicit RecordedMeshes(const std::string& file) {
    RecordingReader reader{std::filesystem::path(file)};
    net::MessageHandlers h;
    net::ServerMessages* messages = nullptr;
    h.on_topology = [&](const net::TopologyMessage& t) { topology = t; };
    h.on_frame = [&](const net::FrameMessage& f) {
      by_tick[f.tick] = messages->mesh().positions();
      for (const TickPose& pose : f.pose_history) poses[pose.tick] = pose.X_WN;
    };
    net::ServerMessages taking(std::move(h));
    messages = &taking;
    read_recording(reader, taking);
    damage = reader.damage();
  }
  net::TopologyMessage topology;
  std::map<std::uint64_t, std::vector<float>> by_tick;
  std::map<std::uint64_t, RigidTransform> poses;
  std::string damage;
};

std::map<std::string, std::string> files_in(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[std::filesystem::relative(entry.path(), folder).string()] = read_file(entry.path());
  return files;
}

std::uintmax_t size_of(const std::string& file) {
  std::error_code missing;
  const std::uintmax_t size = std::filesystem::file_size(file, missing);
  return missing ? 0 : size;
}

// Live and recorded meshes have the same bits, for a second client and for the simulation stepped through the poses.
TEST_F(RecordingTools, ALiveRunIsRecordedAndReplayedBitForBit) {
  const std::string scene = folder.write("scene.toml", small_scene("[device]\nstale_pose_ms = 60000\n"));
  const std::string trajectory = folder.write("t.csv", short_insertion(2));
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  ChildProcess record(
      brachy_line({"record", "--connect", daemon.address, "--out", path("r.brachy"), "--json"}));
  ChildProcess killed(brachy_line({"record", "--connect", daemon.address, "--out", path("killed.brachy")}));
  ChildProcess surface(
      brachy_line({"record", "--connect", daemon.address, "--out", path("s.brachy"), "--surface"}));
  Peer peer(net::Role::kViewer, net::kSubscribePoseHistory, true);
  ASSERT_TRUE(peer.join(daemon.port));
  ASSERT_TRUE(peer.until([&] { return peer.refresh_state() && peer.states.back().viewers == 4; }));
  ChildProcess replay(brachy_line({"replay", trajectory, "--connect", daemon.address, "--json"}));
  ASSERT_TRUE(
      peer.until([&] { return !peer.frames.empty() && peer.needle().contact == ContactState::kInserted; }));
  killed.send_signal(SIGKILL);
  EXPECT_EQ(killed.wait().signal, SIGKILL);
  ASSERT_TRUE(peer.until([&] { return peer.needle().contact == ContactState::kWithdrawn; }));
  ASSERT_TRUE(exited(replay.wait(), 0));
  for (ChildProcess* recorder : {&record, &surface}) recorder->send_signal(SIGINT);
  const Ended recorded = record.wait();
  ASSERT_TRUE(exited(recorded, 0));
  ASSERT_TRUE(exited(surface.wait(), 0));
  daemon.process.send_signal(SIGTERM);
  ASSERT_TRUE(exited(daemon.process.wait(), 0));

  const RecordedMeshes whole(path("r.brachy")), cut(path("killed.brachy")), outside(path("s.brachy"));
  std::size_t shared = 0;
  for (const RecordedMeshes* mine : {&whole, &cut, &outside}) {
    // SIGKILL may end a write at a page: then the last message is not whole, and all before it are.
    const bool is_cut_short =
        mine == &cut && cut.damage.ends_with("it is damaged: the file ends within a message");
    EXPECT_TRUE(mine->damage.empty() || is_cut_short) << mine->damage;
    for (const Peer::Frame& frame : peer.frames) {
      const auto found = mine->by_tick.find(frame.message.tick);
      if (found == mine->by_tick.end()) continue;
      ++shared;
      const std::size_t coordinates =
          mine == &outside ? 3 * whole.topology.surface_vertex_count : frame.positions.size();
      ASSERT_EQ(found->second.size(), coordinates);
      ASSERT_TRUE(std::equal(found->second.begin(), found->second.end(), frame.positions.begin()))
          << "tick " << frame.message.tick;
    }
  }
  EXPECT_GT(shared, 60u);
  EXPECT_GT(cut.by_tick.size(), 3u);
  EXPECT_LT(cut.by_tick.size(), whole.by_tick.size());
  EXPECT_EQ(whole.topology.hash, peer.topology.hash);
  EXPECT_EQ(outside.topology.rest_vertices.size(), 3 * whole.topology.surface_vertex_count);
  for (const auto& [tick, X_WN] : peer.poses) {
    ASSERT_TRUE(whole.poses.contains(tick));
    EXPECT_EQ(whole.poses.at(tick).p, X_WN.p);
    EXPECT_EQ(whole.poses.at(tick).R, X_WN.R);
  }

  // A replay of the recording and of its exported poses give the same, which is the daemon's result.
  for (const char* recording : {"r.brachy", "s.brachy"}) {
    const std::string exported = path(std::string("export_of_") + recording);
    ASSERT_TRUE(exited(run_brachy({"export", path(recording), "--out", exported}), 0));
    nlohmann::json hash;
    for (const std::string& from : {path(recording), exported + "/poses.csv"}) {
      const Ended again = run_brachy({"replay", from, "--offline", "--config", scene, "--json"});
      ASSERT_TRUE(exited(again, 0)) << from;
      if (hash.is_null()) hash = json_of(again).at("state_hash");
      EXPECT_EQ(json_of(again).at("state_hash"), hash) << from;
    }
  }
  const Scene loaded = load_scene(scene);
  Simulator simulator(load_simulation_model(loaded, load_tissue(loaded).tissue));
  MeshState state = simulator.initial_state();
  const RecordedMotion motion = load_recorded_motion(path("r.brachy"), ReplayedModel::kRecorded);
  EXPECT_TRUE(motion.remarks.empty());
  std::size_t compared = 0;
  for (const TrajectorySample& sample : motion.trajectories.needles()[0].motion.samples()) {
    NeedlePose pose;
    pose.present = true;
    pose.X_WN = sample.X_WN;
    simulator.step(pose, state);
    const auto found = whole.by_tick.find(static_cast<std::uint64_t>(std::llround(sample.t_s * 200)));
    if (found == whole.by_tick.end()) continue;
    ++compared;
    ASSERT_EQ(found->second, state.mesh.deformed_vertices) << sample.t_s;
  }
  EXPECT_GT(compared, 20u);

  const auto report = json_of(recorded);
  const auto inspected = json_of(run_brachy({"inspect", path("r.brachy"), "--json"}));
  ASSERT_FALSE(inspected.is_discarded());
  EXPECT_EQ(inspected.at("frames"), whole.by_tick.size());
  EXPECT_EQ(inspected.at("frames"), report.at("snapshots"));
  EXPECT_EQ(inspected.at("poses"), report.at("poses"));
  EXPECT_EQ(inspected.at("bytes"), report.at("bytes"));
  EXPECT_EQ(inspected.at("bytes"), size_of(path("r.brachy")));
  EXPECT_EQ(inspected.at("points"), 3000);
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(whole.topology.hash));
  EXPECT_EQ(inspected.at("topology"), hash);
  EXPECT_EQ(inspected.at("damage"), nullptr);
  EXPECT_GT(inspected.at("max_depth_mm"), 10);
}

/// A needle that moves, at each tick another mesh.
auto moving(std::uint64_t tick) {
  return [tick](MeshState& s) {
    s.mesh.deformed_vertices[2] = 0.25F * static_cast<float>(tick % 1000);
    s.needles.states.resize(1);
    NeedleState& needle = s.needles.states[0];
    needle.present = true;
    needle.contact = ContactState::kInserted;
    needle.X_WN.p = Vec3(0.1 * static_cast<double>(tick), 1.0 / 3, 0);
    s.needles.pose_histories.resize(1);
    s.needles.pose_histories[0][s.summary.tick % NeedleStates::kPoseHistory] = {s.summary.tick, needle.X_WN,
                                                                                false};
  };
}

net::SceneMessage a_scene() {
  net::SceneMessage scene;
  scene.structures = {{"../rectum", {0, 0, 0, 1, 0, 0, 0, 1, 0}, {{0, 1, 2}}}};
  return scene;
}

TEST_F(RecordingTools, AnExportIsWhatRecordWritesIntoAFolder) {
  ServedStates states;
  states.server().set_scene(a_scene());
  states.start({"record"}, {"--out", path("dir")});
  states.start({"record"}, {"--out", path("r.brachy")});
  for (int i = 0; i < 40; ++i) states.show(moving(states.tick()));
  states.tell("a \"warning\", with a comma");
  for (const Ended& ended : states.end()) ASSERT_TRUE(exited(ended, 0));
  const Ended exported = run_brachy({"export", path("r.brachy"), "--out", path("ex"), "--json"});
  ASSERT_TRUE(exited(exported, 0));
  const auto files = files_in(folder / "dir");
  EXPECT_EQ(files, files_in(folder / "ex"));
  EXPECT_EQ(files.size(), 40 + 5 + 2);  // .vtp; .pvd, poses, forces, seeds, events; a structure and its .pvd
  EXPECT_TRUE(files.contains("structures/___rectum.vtp"));
  EXPECT_NE(files.at("events.csv").find("warning,0,\"a \"\"warning\"\", with a comma\"\n"),
            std::string::npos);
  EXPECT_EQ(json_of(exported).at("snapshots"), 40);
  EXPECT_EQ(json_of(exported).at("poses"), 40);

  ASSERT_TRUE(exited(run_brachy({"export", path("r.brachy"), "--out", path("surface"), "--surface"}), 0));
  EXPECT_EQ(files_in(folder / "surface").size(), files.size());
  EXPECT_TRUE(refused_in_one_line(run_brachy({"export", path("r.brachy"), "--out", path("ex")}),
                                  {"ex", "nothing is overwritten"}));
  EXPECT_EQ(files_in(folder / "ex"), files);
}

TEST_F(RecordingTools, TheLagOfTheTissueIsInTheRecordingAndItsReport) {
  ServedStates states;
  states.start({"record"}, {"--out", path("r.brachy")});
  for (const double lag_mm : {0.125, 0.5, 0.25})
    states.show([&](MeshState& s) {
      moving(states.tick())(s);
      s.summary.step_flags = kStepLate;
      s.summary.lag_mm = lag_mm;
    });
  ASSERT_TRUE(exited(states.end().front(), 0));
  const Ended inspected = run_brachy({"inspect", path("r.brachy")});
  EXPECT_NE(inspected.out.find("3 late (tissue at most 0.50 mm behind)"), std::string::npos) << inspected.out;
  const auto json = json_of(run_brachy({"inspect", path("r.brachy"), "--json"}));
  EXPECT_EQ(json.at("frames_late"), 3);
  EXPECT_EQ(json.at("max_lag_mm"), 0.5);
}

TEST_F(RecordingTools, ABentNeedleIsInTheRecordingItsReportAndItsExport) {
  ServedStates states;
  states.start({"record"}, {"--out", path("r.brachy")});
  for (int i = 0; i < 5; ++i)
    states.show([&](MeshState& s) {
      moving(states.tick())(s);
      NeedleShape& shape = s.needles.states[0].shape;
      shape.is_bent = true;
      shape.tip_deflection = Vec3(0.75 * i, i, 0);
    });
  ASSERT_TRUE(exited(states.end().front(), 0));
  const Ended inspected = run_brachy({"inspect", path("r.brachy")});
  EXPECT_NE(inspected.out.find("needles bend: tip deflected by at most 5.00 mm"), std::string::npos)
      << inspected.out;
  EXPECT_EQ(json_of(run_brachy({"inspect", path("r.brachy"), "--json"})).at("max_tip_deflection_mm"), 5);
  ASSERT_TRUE(exited(run_brachy({"export", path("r.brachy"), "--out", path("ex")}), 0));
  const std::vector<ForceSample> forces = load_force_log(folder / "ex/forces.csv");
  ASSERT_EQ(forces.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(forces[i].tip_deflection_mm, 1.25 * static_cast<double>(i));
  EXPECT_TRUE(exited(run_brachy({"replay", path("r.brachy"), "--offline", "--json"}), 0));
}

TEST_F(RecordingTools, AResetBeginsAnotherRun) {
  ServedStates states;
  states.start({"record"}, {"--out", path("r.brachy")});
  for (int i = 0; i < 10; ++i) states.show(moving(states.tick()));
  states.tell({net::EventKind::kReset, 0, 10, "reset"});
  states.show([](MeshState& s) {
    s.summary.tick = 1;
    s.mesh.block_ticks = {1};
    moving(1)(s);
  });
  for (int i = 0; i < 4; ++i) states.show(moving(states.tick()));
  for (const Ended& ended : states.end()) ASSERT_TRUE(exited(ended, 0));

  EXPECT_TRUE(refused_in_one_line(run_brachy({"replay", path("r.brachy"), "--offline"}),
                                  {"the simulation was reset at tick 1", "brachy export"}));
  const auto inspected = json_of(run_brachy({"inspect", path("r.brachy"), "--json"}));
  EXPECT_EQ(inspected.at("resets"), 1);
  EXPECT_EQ(inspected.at("ticks_missed"), 0);
  const auto exported = json_of(run_brachy({"export", path("r.brachy"), "--out", path("ex"), "--json"}));
  EXPECT_EQ(exported.at("runs"), 2);
  EXPECT_EQ(exported.at("snapshots"), 15);
  EXPECT_EQ(exported.at("poses"), 15);
  EXPECT_EQ(load_trajectories(folder / "ex/poses.csv").needles()[0].motion.samples().size(), 10u);
  EXPECT_EQ(load_trajectories(folder / "ex/run_2/poses.csv").needles()[0].motion.samples().size(), 5u);
}

TEST_F(RecordingTools, WhatAnOperatorDidIsSeenInARecording) {
  const std::string scene = folder.write("scene.toml", small_scene());
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  ChildProcess record(brachy_line({"record", "--connect", daemon.address, "--out", path("r.brachy")}));
  Peer boss(net::Role::kOperator);
  ASSERT_TRUE(boss.join(daemon.port));
  ASSERT_TRUE(boss.until([&] { return boss.refresh_state() && boss.states.back().viewers == 1; }));
  net::ControlMessage control;
  control.action = net::ControlAction::kModel;
  control.support_radius_mm = 8;
  boss.client.control(control);
  ASSERT_TRUE(
      boss.until([&] { return boss.refresh_state() && boss.states.back().controls.support_radius_mm == 8; }));
  control.action = net::ControlAction::kReset;
  boss.client.control(control);
  ASSERT_TRUE(boss.until([&] { return boss.has_event(net::EventKind::kReset); }));
  const std::size_t seen = boss.frames.size();
  ASSERT_TRUE(boss.until([&] { return boss.frames.size() > seen + 2 && boss.last().message.tick > 20; }));
  record.send_signal(SIGINT);
  ASSERT_TRUE(exited(record.wait(), 0));
  daemon.process.send_signal(SIGTERM);
  ASSERT_TRUE(exited(daemon.process.wait(), 0));

  const auto inspected = json_of(run_brachy({"inspect", path("r.brachy"), "--json"}));
  EXPECT_EQ(inspected.at("resets"), 1);
  EXPECT_EQ(inspected.at("model_changes"), 1);
  EXPECT_EQ(inspected.at("support_radius_mm"), 8);
  EXPECT_EQ(inspected.at("scene"), true);
  EXPECT_TRUE(refused_in_one_line(run_brachy({"replay", path("r.brachy"), "--offline", "--config", scene}),
                                  {"another model was chosen at tick "}));
  const auto exported = json_of(run_brachy({"export", path("r.brachy"), "--out", path("ex"), "--json"}));
  EXPECT_EQ(exported.at("runs"), 2);
  EXPECT_TRUE(std::filesystem::exists(folder / "ex/run_2/recording.pvd"));
  EXPECT_NE(read_file(folder / "ex/events.csv").find(",reset,0,\"reset by "), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "ex/structures/urethra.vtp"));
}

TEST_F(RecordingTools, KilledAtAnyMomentTheFileIsGoodUpToThere) {
  for (const int after : {1, 7, 40, 200}) {
    ServedStates states;
    const std::string file = path("killed_" + std::to_string(after) + ".brachy");
    ChildProcess& recorder = states.start({"record"}, {"--out", file});
    std::map<std::uint64_t, float> shown;
    const auto show = [&] {
      shown[states.tick() + 1] = 0.25F * static_cast<float>(states.tick() % 1000);
      states.show(moving(states.tick()));
    };
    // Waits until some of it has been written; of many at once only the newest are sent.
    for (int i = 0; i < after || size_of(file) < 400u * static_cast<unsigned>(after); ++i) show();
    recorder.send_signal(SIGKILL);
    for (int i = 0; i < 5; ++i) show();
    EXPECT_EQ(states.end().front().signal, SIGKILL);
    const RecordedMeshes recorded(file);
    EXPECT_EQ(recorded.damage, "");
    EXPECT_FALSE(recorded.by_tick.empty());
    for (const auto& [tick, positions] : recorded.by_tick) EXPECT_EQ(positions[2], shown.at(tick)) << tick;
    const Ended inspected = run_brachy({"inspect", file, "--json"});
    ASSERT_TRUE(exited(inspected, 0));
    EXPECT_EQ(json_of(inspected).at("frames"), recorded.by_tick.size());
  }
}

TEST_F(RecordingTools, ATornEndIsSaidAndTheRestIsUsed) {
  ServedStates states;
  states.start({"record"}, {"--out", path("r.brachy")});
  for (int i = 0; i < 20; ++i) states.show(moving(states.tick()));
  ASSERT_TRUE(exited(states.end().front(), 0));
  const std::string whole = read_file(path("r.brachy"));
  const std::string torn = folder.write("torn.brachy", whole.substr(0, whole.size() / 2));
  const Ended inspected = run_brachy({"inspect", torn});
  ASSERT_TRUE(exited(inspected, 0));
  EXPECT_NE(inspected.out.find("DAMAGED: from byte "), std::string::npos) << inspected.out;
  const Ended exported = run_brachy({"export", torn, "--out", path("ex"), "--json"});
  ASSERT_TRUE(exited(exported, 0));
  EXPECT_NE(exported.err.find("the file ends within a message"), std::string::npos) << exported.err;
  EXPECT_GT(json_of(exported).at("snapshots").get<int>(), 0);
  EXPECT_LT(json_of(exported).at("snapshots").get<int>(), 20);
  EXPECT_FALSE(json_of(exported).at("damage").is_null());
  const Ended replayed = run_brachy({"replay", torn, "--offline", "--json"});
  ASSERT_TRUE(exited(replayed, 0));
  EXPECT_NE(replayed.err.find("from byte "), std::string::npos) << replayed.err;
}

TEST_F(RecordingTools, AFullDiskEndsTheRecordingAndLeavesItGood) {
  ServedStates states;
  ChildProcess& recorder = states.start_line(
      {"/bin/sh", "-c", "trap '' XFSZ; ulimit -f 16; exec \"$@\"", "sh", BRACHY_BINARY, "record"},
      {"--out", path("r.brachy"), "--json"});
  for (int i = 0; i < 200; ++i) states.show(moving(states.tick()));
  while (size_of(path("r.brachy")) < 6000) states.serve();
  const Ended ended = states.end().front();
  EXPECT_FALSE(recorder.is_running());
  EXPECT_TRUE(exited(ended, 1));
  EXPECT_NE(ended.err.find("r.brachy: cannot be written any more: "), std::string::npos) << ended.err;
  EXPECT_EQ(json_of(ended).at("bytes"), size_of(path("r.brachy")));
  const RecordedMeshes recorded(path("r.brachy"));
  EXPECT_EQ(recorded.damage, "");
  EXPECT_EQ(json_of(ended).at("snapshots"), recorded.by_tick.size());
  EXPECT_GT(recorded.by_tick.size(), 5u);
}

TEST_F(RecordingTools, RefuseWhatIsNoneAndOverwriteNothing) {
  const std::string mine = folder.write("mine.brachy", "mine");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"record", "--connect", "127.0.0.1:1", "--out", mine}),
                                  {mine, "nothing is overwritten"}));
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"record", "--connect", "127.0.0.1:1", "--out", path("no folder/r.brachy")}),
      {"no folder"}));
  EXPECT_EQ(read_file(mine), "mine");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"export", mine, "--out", path("ex")}),
                                  {mine, "not a recording: it does not begin with BRCYREC1"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"export", path("none.brachy"), "--out", path("ex")}),
                                  {"no such file"}));
  EXPECT_FALSE(std::filesystem::exists(folder / "ex"));
  const std::string empty = folder.write("empty.brachy", "BRCYREC1");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", empty}), {empty, "brachy export"}));
  const std::string later = folder.write("later.brachy", "BRCYREC2");
  for (const char* tool : {"inspect", "replay"}) {
    std::vector<std::string> line = {tool, later};
    if (line[0] == "replay") line.push_back("--offline");
    EXPECT_TRUE(refused_in_one_line(run_brachy(line), {later, "of another version"}));
  }
}

TEST_F(RecordingTools, ARecordingIsPlayedIntoADaemon) {
  const std::string scene = folder.write("scene.toml", small_scene("[device]\nstale_pose_ms = 60000\n"));
  ServedStates states;
  states.start({"record"}, {"--out", path("r.brachy")});
  for (int i = 0; i < 60; ++i) states.show(moving(states.tick()));
  ASSERT_TRUE(exited(states.end().front(), 0));
  RunningBrachyd daemon(scene);
  ASSERT_NE(daemon.port, 0);
  const Ended played = run_brachy({"replay", path("r.brachy"), "--connect", daemon.address, "--json"});
  ASSERT_TRUE(exited(played, 0));
  // These states hold a pose each: one that a newer state replaced on its way is not in the recording.
  EXPECT_LE(json_of(played).at("duration_s").get<double>(), 59 / 200.0 + 1e-9);
  EXPECT_GT(json_of(played).at("duration_s").get<double>(), 50 / 200.0);
  EXPECT_GT(json_of(played).at("poses_accepted").get<int>(), 10);
}

}  // namespace
}  // namespace brachy
