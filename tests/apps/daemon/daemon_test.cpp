#include "apps/daemon/daemon.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "core/base/error.h"
#include "core/scene/load_simulation_model.h"
#include "core/scene/load_tissue.h"
#include "core/simulation/simulator.h"
#include "haptics/devices/pose_guard.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

bool is_in_contact(ContactState contact) {
  return contact == ContactState::kTouching || contact == ContactState::kInserted ||
         contact == ContactState::kThrough;
}

/// The simulation repeated in this thread: the expected mesh of a viewer, tick by tick.
class Shadow {
 public:
  explicit Shadow(const Scene& scene) : simulator_(load_simulation_model(scene, load_tissue(scene).tissue)) {}

  /// Steps up to `tick` with the poses that the daemon used; before the first one there is no needle.
  const MeshState& at(std::uint64_t tick, const std::map<std::uint64_t, RigidTransform>& poses) {
    while (state_.summary.tick < tick) {
      const auto found = poses.find(state_.summary.tick + 1);
      pose_.present = found != poses.end();
      if (pose_.present) pose_.X_WN = found->second;
      simulator_.step(pose_, state_);
    }
    return state_;
  }

 private:
  Simulator simulator_;
  MeshState state_ = simulator_.initial_state();
  NeedlePose pose_;
};

void expect_frames_equal_simulation(const Scene& scene, const std::vector<Peer::Frame>& frames,
                                    const std::map<std::uint64_t, RigidTransform>& poses) {
  Shadow shadow(scene);
  std::size_t compared = 0;
  for (const Peer::Frame& frame : frames) {
    const net::FrameMessage& m = frame.message;
    const MeshState& state = shadow.at(m.tick, poses);
    ASSERT_EQ(state.summary.tick, m.tick) << "frames go back in time";
    ASSERT_TRUE(same_bits(frame.positions, state.mesh.deformed_vertices)) << "at tick " << m.tick;
    ASSERT_EQ(m.max_displacement_mm, state.summary.max_displacement_mm) << "at tick " << m.tick;
    ASSERT_EQ(m.moved_vertices, state.summary.moved_vertices) << "at tick " << m.tick;
    ASSERT_EQ(m.step_flags, state.summary.step_flags) << "at tick " << m.tick;
    ASSERT_EQ(m.lag_mm, static_cast<double>(static_cast<float>(state.summary.lag_mm)))
        << "at tick " << m.tick;
    ASSERT_TRUE(m.certificate);
    ASSERT_EQ(m.certificate->verdict, state.summary.certificate.verdict) << "at tick " << m.tick;
    ASSERT_EQ(m.certificate->vertex_det, state.summary.certificate.vertex_det) << "at tick " << m.tick;
    ASSERT_EQ(m.certificate->held_mm, state.summary.certificate.held_mm) << "at tick " << m.tick;
    ASSERT_EQ(m.sim_time_s, state.summary.sim_time_s);
    ASSERT_EQ(m.needles.size(), 1u);
    const NeedleState& needle = m.needles[0].state;
    ASSERT_EQ(needle.present, state.needles.states[0].present) << "at tick " << m.tick;
    ASSERT_EQ(needle.contact, state.needles.states[0].contact) << "at tick " << m.tick;
    ASSERT_EQ(needle.insertion_depth_mm, state.needles.states[0].insertion_depth_mm) << "at tick " << m.tick;
    ASSERT_EQ(needle.landmark_count, state.needles.states[0].landmark_count) << "at tick " << m.tick;
    ++compared;
  }
  EXPECT_GT(compared, 0u);
}

// Every tick from the first pose to the last has one: otherwise the comparison above would be void.
void expect_no_pose_missing(const std::map<std::uint64_t, RigidTransform>& poses) {
  ASSERT_FALSE(poses.empty());
  EXPECT_EQ(poses.rbegin()->first - poses.begin()->first + 1, poses.size());
}

// A viewer that stops reading: the others are served, and it catches up with the newest mesh.
TEST(DaemonLoopback, EveryViewersMeshEqualsTheSimulationBitForBit) {
  Scene scene = small();
  scene.tissue = {};  // the whole phantom: 175 kB a full frame, so that what is not read fills the buffers
  RunningDaemon daemon(scene);
  Peer viewer(net::Role::kViewer, net::kSubscribePoseHistory, true, "viewer");
  Peer slow(net::Role::kViewer, net::kSubscribeFullFrames, true, "slow");
  Peer late(net::Role::kViewer, 0, true, "late");
  Peer device(net::Role::kDevice, 0, false, "device");
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(viewer.until([&] { return !viewer.frames.empty(); }));
  ASSERT_TRUE(slow.join(daemon.port()));
  ASSERT_TRUE(slow.until([&] { return !slow.frames.empty(); }));
  ASSERT_TRUE(device.join(daemon.port()));
  const auto serve_viewer = [&] {
    viewer.poll();
    return false;
  };
  const auto show = [&](const RigidTransform& X_WN) {
    const std::int64_t stamp_ns = monotonic_ns();
    device.client.send_pose(X_WN, stamp_ns);
    return viewer.until([&] {
      device.poll();
      return viewer.last().message.input_stamp_ns == stamp_ns;
    });
  };

  for (const RigidTransform& X_WN : way_in()) ASSERT_TRUE(show(X_WN));
  EXPECT_EQ(viewer.needle().contact, ContactState::kInserted);
  EXPECT_GT(viewer.last().message.max_displacement_mm, 0.5);

  ASSERT_TRUE(late.join(daemon.port()));
  ASSERT_TRUE(late.until([&] { return serve_viewer() || !late.frames.empty(); }));
  EXPECT_TRUE(late.frames[0].message.full);
  EXPECT_GT(late.frames[0].message.max_displacement_mm, 0.5);

  // 60 frames of 175 kB are more than the buffers of both ends hold.
  const std::uint64_t waits_until = viewer.frames.size() + 60;
  ASSERT_TRUE(viewer.until([&] { return viewer.frames.size() >= waits_until; }));
  const std::uint64_t resumed_at = viewer.last().message.tick;
  ASSERT_TRUE(slow.until([&] { return serve_viewer() || slow.last().message.tick >= resumed_at; }));
  EXPECT_GT(slow.client.snapshots_missed(), 0u);

  for (const RigidTransform& X_WN : way_out()) ASSERT_TRUE(show(X_WN));
  const std::uint64_t end = viewer.last().message.tick;
  for (Peer* peer : {&late, &slow})
    ASSERT_TRUE(peer->until([&] { return serve_viewer() || peer->last().message.tick >= end; }));
  for (Peer* peer : {&viewer, &late, &slow}) {
    EXPECT_EQ(peer->needle().contact, ContactState::kWithdrawn);
    EXPECT_TRUE(same_bits(peer->last().positions, peer->topology.rest_vertices));
    EXPECT_TRUE(peer->closed.empty());
  }
  // The last frames of the others may be a few ticks later than the viewer's: it must know those ticks' poses.
  const std::uint64_t newest = std::max(late.last().message.tick, slow.last().message.tick);
  ASSERT_TRUE(viewer.until([&] { return viewer.last().message.tick >= newest; }));
  daemon.stop();

  expect_no_pose_missing(viewer.poses);
  for (Peer* peer : {&viewer, &late, &slow}) {
    SCOPED_TRACE(peer == &viewer ? "viewer" : peer == &late ? "late joiner" : "slow viewer");
    expect_frames_equal_simulation(scene, peer->frames, viewer.poses);
  }
}

// A tick's work is counted, so on a machine for which the scene says that work is dear the tissue lags, however fast
// the machine is.
TEST(DaemonLoopback, AViewerIsToldHowFarTheTissueThatItIsShownLags) {
  Scene scene = small();
  scene.model.kernel = "elastic";
  scene.work_costs = WorkCosts{}.slower_by(20);
  RunningDaemon daemon(scene);
  Peer viewer(net::Role::kViewer, net::kSubscribePoseHistory, true, "viewer");
  Peer device(net::Role::kDevice, 0, false, "device");
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(device.join(daemon.port()));
  viewer.stand_beside(device);
  int turn = 0;
  const auto is_late = [](const Peer::Frame& frame) { return frame.message.lag_mm > WorkBudget{}.lag_mm; };
  ASSERT_TRUE(viewer.until([&] {
    RigidTransform X_WN = way_in().back();
    X_WN.p.x() += std::sin(0.4 * ++turn);
    device.client.send_pose(X_WN, monotonic_ns());
    return std::ranges::count_if(viewer.frames, is_late) >= 5;
  }));
  daemon.stop();
  expect_frames_equal_simulation(scene, viewer.frames, viewer.poses);
}

TEST(DaemonScriptedDevice, MovesTheTissueAndLeavesItBitwiseAtRest) {
  const TempFolder folder;
  folder.write("t.csv", short_insertion(1));
  Scene scene = small();
  scene.directory = folder / "";
  scene.device.kind = "scripted";
  scene.device.trajectory = "t.csv";
  scene.device.loop = true;  // the first and the last pose are the same: nothing depends on when we join
  RunningDaemon daemon(scene);
  Peer viewer(net::Role::kViewer, 0, true);
  ASSERT_TRUE(viewer.join(daemon.port()));
  bool was_in = false;
  ASSERT_TRUE(viewer.until([&] {
    if (viewer.frames.empty()) return false;
    was_in |= viewer.needle().contact == ContactState::kInserted;
    return was_in && viewer.needle().contact == ContactState::kWithdrawn;
  }));
  std::size_t moved = 0, at_rest = 0;
  for (const Peer::Frame& frame : viewer.frames) {
    const bool rest = same_bits(frame.positions, viewer.topology.rest_vertices);
    const bool contact = is_in_contact(frame.message.needles.at(0).state.contact);
    EXPECT_TRUE(contact || rest) << "at tick " << frame.message.tick;
    EXPECT_EQ(rest, frame.message.moved_vertices == 0) << "at tick " << frame.message.tick;
    ++(rest ? at_rest : moved);
  }
  EXPECT_GT(moved, 3u);
  EXPECT_GT(at_rest, 0u);
  const DaemonSummary& summary = daemon.stop();
  EXPECT_GT(summary.loop.max_displacement_mm, 0.5);
  EXPECT_GT(summary.loop.moved_vertices, 100u);
  EXPECT_GT(summary.loop.latency_ns.count(), 0u);
}

TEST(DaemonScriptedDevice, HoldsTheLeaseSoThatNoNetworkDeviceGetsIn) {
  const TempFolder folder;
  folder.write("t.csv", short_insertion(1));
  Scene scene = small();
  scene.directory = folder / "";
  scene.device.kind = "scripted";
  scene.device.trajectory = "t.csv";
  RunningDaemon daemon(scene);
  Peer device(net::Role::kDevice);
  device.connect(daemon.port());
  ASSERT_TRUE(device.until([&] { return !device.closed.empty(); }));
  ASSERT_EQ(device.errors.size(), 1u);
  EXPECT_EQ(device.errors[0].code, net::ErrorCode::kDeviceBusy);
  EXPECT_NE(device.errors[0].text.find("scripted device"), std::string::npos) << device.errors[0].text;
  EXPECT_FALSE(device.welcomed);
}

TEST(DaemonDevice, ASecondOneIsToldWhoHoldsTheLeaseAndGetsItAfterwards) {
  RunningDaemon daemon(small());
  Peer viewer, second(net::Role::kDevice, 0, false, "second");
  {
    Peer first(net::Role::kDevice, 0, false, "left hand");
    ASSERT_TRUE(first.join(daemon.port()));
    ASSERT_TRUE(viewer.join(daemon.port()));
    ASSERT_TRUE(viewer.refresh_state());
    EXPECT_NE(viewer.states.back().device_holder.find("left hand"), std::string::npos);
    second.connect(daemon.port());
    ASSERT_TRUE(second.until([&] { return !second.closed.empty(); }));
    ASSERT_EQ(second.errors.size(), 1u);
    EXPECT_EQ(second.errors[0].code, net::ErrorCode::kDeviceBusy);
    EXPECT_TRUE(second.errors[0].fatal);
    EXPECT_NE(second.errors[0].text.find("left hand (127.0.0.1:"), std::string::npos)
        << second.errors[0].text;
    ASSERT_TRUE(first.show(tip_at(8, -4, -40)));
  }
  ASSERT_TRUE(
      viewer.until([&] { return viewer.refresh_state() && viewer.states.back().device_holder.empty(); }));
  // The needle stays where it was last seen until the next device sends a pose.
  ASSERT_TRUE(viewer.until([&] { return !viewer.frames.empty() && viewer.needle().present; }));
  EXPECT_EQ(viewer.needle().X_WN.p, Vec3(8, -4, -40));
  Peer third(net::Role::kDevice, 0, false, "third");
  ASSERT_TRUE(third.join(daemon.port()));
  // Its clock and count start again: sequence 2 follows the first device's without being refused.
  ASSERT_TRUE(third.show(tip_at(8, -4, -39)));
  EXPECT_EQ(daemon.stop().poses_accepted, 2u);
}

TEST(DaemonDevice, BadPosesAreRefusedCountedAndReportedAndTheNeedleStays) {
  Scene scene = small();
  scene.device.stale_pose_ms = 1;
  RunningDaemon daemon(scene);
  Peer device(net::Role::kDevice);
  ASSERT_TRUE(device.join(daemon.port()));
  const RigidTransform good = tip_at(8, -4, -40);
  ASSERT_TRUE(device.show(good));
  const std::int64_t good_stamp_ns = device.last().message.input_stamp_ns;

  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  RigidTransform sheared = good, mirrored = good;
  sheared.R(0, 1) = 0.5;
  mirrored.R(0, 0) = -1;
  device.client.send_pose(tip_at(kNaN, 0, 0), monotonic_ns());
  device.client.send_pose(tip_at(0, 0, HUGE_VAL), monotonic_ns());
  device.client.send_pose(sheared, monotonic_ns());
  device.client.send_pose(mirrored, monotonic_ns());
  device.client.send_pose(tip_at(0, 0, 1e6), monotonic_ns());
  device.client.send_pose(tip_at(0, 0, 0), good_stamp_ns);
  device.client.send_pose(tip_at(0, 0, 0), good_stamp_ns - 1);
  // Taken right after the good one, sent many ticks of 5 ms later.
  const std::uint64_t good_tick = device.last().message.tick;
  ASSERT_TRUE(device.until([&] { return device.last().message.tick > good_tick + 40; }));
  device.client.send_pose(tip_at(0, 0, 0), good_stamp_ns + 1);

  std::map<PoseStatus, std::uint64_t> counts;
  ASSERT_TRUE(device.until([&] {
    std::uint64_t total = 0;
    if (!device.refresh_state()) return false;
    for (const net::PoseRefusals& r : device.states.back().refusals)
      total += counts[static_cast<PoseStatus>(r.code)] = r.count;
    return total == 8;
  }));
  const std::map<PoseStatus, std::uint64_t> expected = {{PoseStatus::kNotFinite, 2},
                                                        {PoseStatus::kNotRigid, 2},
                                                        {PoseStatus::kStale, 1},
                                                        {PoseStatus::kOutOfOrder, 2},
                                                        {PoseStatus::kOutOfRange, 1}};
  EXPECT_EQ(counts, expected);
  EXPECT_EQ(device.states.back().poses_accepted, 1u);

  // The sender is notified of each, at most a few times a second.
  const PoseStatus first[] = {PoseStatus::kNotFinite, PoseStatus::kNotFinite, PoseStatus::kNotRigid,
                              PoseStatus::kNotRigid};
  ASSERT_GE(device.errors.size(), std::size(first));
  for (std::size_t i = 0; i < std::size(first); ++i) {
    const net::ErrorMessage& error = device.errors[i];
    EXPECT_EQ(error.code, net::ErrorCode::kPoseRefused);
    EXPECT_EQ(error.reason, static_cast<std::uint16_t>(first[i])) << error.text;
    EXPECT_EQ(error.text, to_string(first[i]));
    EXPECT_FALSE(error.fatal);
  }

  const std::uint64_t now = device.last().message.tick;
  ASSERT_TRUE(device.until([&] { return device.last().message.tick > now + 10; }));
  EXPECT_EQ(device.needle().X_WN, good);
  EXPECT_EQ(device.last().message.input_stamp_ns, good_stamp_ns);
  const DaemonSummary& summary = daemon.stop();
  EXPECT_EQ(summary.poses_accepted, 1u);
  EXPECT_EQ(summary.poses_refused, 8u);
}

TEST(DaemonDevice, PosesOfAViewerAreRefused) {
  RunningDaemon daemon(small());
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port()));
  viewer.client.send_pose(tip_at(0, 0, 0), monotonic_ns());
  ASSERT_TRUE(viewer.until([&] { return !viewer.errors.empty(); }));
  EXPECT_EQ(viewer.errors[0].code, net::ErrorCode::kNotDevice);
  ASSERT_TRUE(viewer.until([&] { return !viewer.frames.empty(); }));
  EXPECT_FALSE(viewer.needle().present);
}

TEST(DaemonEvents, TellWhatHappensToDeviceAndNeedleInOrder) {
  RunningDaemon daemon(small());
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port()));
  {
    Peer device(net::Role::kDevice, 0, false, "hand");
    ASSERT_TRUE(device.join(daemon.port()));
    for (const auto& way : {way_in(), way_out()})
      for (const RigidTransform& X_WN : way) {
        const std::int64_t stamp_ns = monotonic_ns();
        device.client.send_pose(X_WN, stamp_ns);
        ASSERT_TRUE(viewer.until([&] {
          device.poll();
          return !viewer.frames.empty() && viewer.last().message.input_stamp_ns == stamp_ns;
        }));
      }
  }
  ASSERT_TRUE(viewer.until([&] {
    return !viewer.events.empty() && viewer.events.back().kind == net::EventKind::kDeviceDetached;
  }));
  std::vector<std::string> told;
  for (const net::EventMessage& event : viewer.events) {
    EXPECT_FALSE(event.text.empty());
    if (event.kind == net::EventKind::kWarning || event.kind == net::EventKind::kSafety)
      continue;  // the guards of field and force are tested elsewhere
    told.push_back(event.kind == net::EventKind::kContact ? event.text : std::to_string(int(event.kind)));
  }
  // Attached, touching, punctured and inserted, withdrawn, detached.
  EXPECT_EQ(told, (std::vector<std::string>{"5", "touching", "3", "inserted", "withdrawn", "6"}));
  EXPECT_NE(viewer.events.front().text.find("hand"), std::string::npos);
  std::uint64_t tick = 0;
  for (const net::EventMessage& event : viewer.events) {
    if (event.kind != net::EventKind::kContact && event.kind != net::EventKind::kPuncture) continue;
    EXPECT_GE(event.tick, tick);
    EXPECT_GT(event.tick, 0u);
    tick = event.tick;
  }
}

TEST(DaemonState, CountsTicksLatencyAndClients) {
  RunningDaemon daemon(small());
  Peer first, second, device(net::Role::kDevice);
  ASSERT_TRUE(first.join(daemon.port()));
  ASSERT_TRUE(second.join(daemon.port()));
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.show(tip_at(8, -4, -40)));
  ASSERT_TRUE(first.until([&] {
    return first.refresh_state() && first.states.back().ticks > 0 && first.states.back().latency_ms.count > 0;
  }));
  const net::StateMessage& state = first.states.back();
  EXPECT_EQ(state.clients, 3u);
  EXPECT_EQ(state.viewers, 2u);
  EXPECT_EQ(state.poses_accepted, 1u);
  EXPECT_EQ(state.tick_ms.count, state.ticks);
  EXPECT_EQ(state.latency_ms.count, 1u);
  EXPECT_GT(state.tick_ms.p50, 0);
  EXPECT_LE(state.tick_ms.p50, state.tick_ms.max);
  EXPECT_GT(state.snapshots, 0u);
}

TEST(DaemonEnd, StopEndsRunAndTellsTheClients) {
  RunningDaemon daemon(small());
  Peer viewer, device(net::Role::kDevice);
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(viewer.until([&] { return viewer.frames.size() > 2; }));
  const DaemonSummary& summary = daemon.stop();
  for (Peer* peer : {&viewer, &device}) {
    ASSERT_TRUE(peer->until([&] { return !peer->closed.empty(); }));
    ASSERT_FALSE(peer->errors.empty());
    EXPECT_EQ(peer->errors.back().code, net::ErrorCode::kShutdown);
  }
  EXPECT_GT(summary.loop.ticks, 0u);
  EXPECT_GE(summary.snapshots, viewer.frames.size());
  EXPECT_EQ(summary.loop.tick_ns.count(), summary.loop.ticks);
  EXPECT_GT(summary.elapsed_s, 0);
  EXPECT_EQ(summary.loop.max_displacement_mm, 0);
}

TEST(DaemonEnd, StopBeforeItRunsEndsItToo) {
  Daemon daemon(small(), {});
  daemon.stop();
  daemon.stop();
  daemon.run();  // returns
}

TEST(DaemonEnd, ItEndsAfterItsDuration) {
  RunningDaemon daemon(small(), 0.2);
  const DaemonSummary& summary = daemon.wait();
  EXPECT_GE(summary.elapsed_s, 0.2);
  EXPECT_GT(summary.loop.ticks, 0u);
}

TEST(DaemonStart, APortInUseIsAUserError) {
  const RunningDaemon first(small());
  DaemonOptions options;
  options.port = first.port();
  try {
    Daemon second(small(), options);
    FAIL() << "two daemons on port " << first.port();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find(std::to_string(first.port())), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace brachy
