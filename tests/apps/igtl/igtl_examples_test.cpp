// OpenIGTLink's own example programs (Debian's openigtlink-examples) as clients of the real brachyd.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <set>
#include <sstream>

#include "test_paths.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"

namespace brachy {
namespace {

using namespace test;

std::string example(const std::string& name) {
  return std::string(IGTL_EXAMPLES_DIR) + "/" + name;
}

/// A brachyd with OpenIGTLink on a free port.
struct IgtlBrachyd {
  explicit IgtlBrachyd(const std::string& scene) : daemon(scene, {"--igtl-port", "0"}) {
    constexpr std::string_view kSays = "{\"igtl_on\":\"127.0.0.1:", kEnd = "\"}";
    const auto line = daemon.process.read_line();
    if (!line || !line->starts_with(kSays)) {
      ADD_FAILURE() << "brachyd's second line: " << line.value_or("none");
      return;
    }
    igtl_port = line->substr(kSays.size(), line->size() - kSays.size() - kEnd.size());
  }
  std::vector<std::string> client(const std::string& program,
                                  const std::vector<std::string>& more = {}) const {
    std::vector<std::string> line = {example(program), "127.0.0.1", igtl_port};
    line.insert(line.end(), more.begin(), more.end());
    return line;
  }
  RunningBrachyd daemon;
  std::string igtl_port;
};

/// The next matrix that an example prints with igtl::PrintMatrix: its rows without the last, as text. None at the
/// end, which may cut one in two where the example was stopped.
std::optional<std::vector<std::string>> read_matrix(ChildProcess& client) {
  std::optional<std::string> line;
  do {
    line = client.read_line();
    if (!line) return std::nullopt;
  } while (!line->starts_with("====="));
  std::vector<std::string> rows;
  while ((line = client.read_line()) && !line->starts_with("=====")) rows.push_back(*line);
  if (!line || rows.size() != 4) return std::nullopt;
  rows.pop_back();
  return rows;
}

/// As igtl::PrintMatrix prints it.
std::vector<std::string> printed(const RigidTransform& X) {
  std::vector<std::string> rows;
  for (int row = 0; row < 3; ++row) {
    std::ostringstream out;
    for (int column = 0; column < 3; ++column) out << static_cast<float>(X.R(row, column)) << ", ";
    out << static_cast<float>(X.p(row));
    rows.push_back(out.str());
  }
  return rows;
}

struct IgtlExamples : ::testing::Test {
  TempFolder folder;
  /// A scripted needle at rest in front of the gland.
  std::string still_scene() {
    folder.write("still.csv",
                 "t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n"
                 "0,1,0,0,8,0,1,0,-4,0,0,1,-34.5\n1,1,0,0,8,0,1,0,-4,0,0,1,-34.5\n");
    return folder.write("still.toml",
                        small_scene("[device]\nkind = \"scripted\"\ntrajectory = \"still.csv\"\n"));
  }
  const RigidTransform at_rest = {Mat3::Identity(), Vec3(8, -4, -34.5)};
};

TEST_F(IgtlExamples, ATrackerClientMovesTheNeedle) {
  IgtlBrachyd brachyd(folder.write("scene.toml", small_scene("[device]\nstale_pose_ms = 60000\n")));
  ChildProcess tracker(brachyd.client("TrackerClient3", {"50", "NeedleToRas"}));
  Peer viewer(net::Role::kViewer, net::kSubscribePoseHistory);
  ASSERT_TRUE(viewer.join(brachyd.daemon.port));
  ASSERT_TRUE(viewer.until([&] { return viewer.poses.size() > 50; }));
  ASSERT_TRUE(viewer.refresh_state());
  EXPECT_NE(viewer.states.back().device_holder.find("NeedleToRas (OpenIGTLink 127.0.0.1:"),
            std::string::npos);
  EXPECT_EQ(viewer.states.back().refusals.size(), 0u);
  tracker.send_signal(SIGTERM);
  ASSERT_TRUE(viewer.until([&] {
    return !viewer.events.empty() && viewer.events.back().kind == net::EventKind::kDeviceDetached;
  }));

  std::set<std::vector<std::string>> sent;
  while (const auto matrix = read_matrix(tracker)) sent.insert(*matrix);
  std::size_t seen = 0;
  for (const auto& [tick, X_WN] : viewer.poses) seen += sent.contains(printed(X_WN));
  // Rotations are made exact before they are used, which may change a digit that is printed.
  EXPECT_GT(seen, viewer.poses.size() / 4);
  std::set<std::string> tips, seen_tips;
  const auto tip = [](const std::vector<std::string>& rows) {
    std::string all;
    for (const std::string& row : rows) all += row.substr(row.rfind(','));
    return all;
  };
  for (const auto& matrix : sent) tips.insert(tip(matrix));
  for (const auto& [tick, X_WN] : viewer.poses)
    EXPECT_TRUE(tips.contains(tip(printed(X_WN)))) << "tick " << tick;
}

TEST_F(IgtlExamples, ATrackerClientMovesEachNeedleItNames) {
  IgtlBrachyd brachyd(
      folder.write("scene.toml", small_scene("[device]\nstale_pose_ms = 60000\n[needle]\ncount = 3\n")));
  ChildProcess tracker(brachyd.client("TrackerClient3", {"50", "Needle0ToRas", "Needle2ToRas", "Reference"}));
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.daemon.port));
  ASSERT_TRUE(viewer.until([&] {
    return !viewer.frames.empty() && viewer.last().message.needles[0].state.present &&
           viewer.last().message.needles[2].state.present;
  }));
  EXPECT_FALSE(viewer.last().message.needles[1].state.present);
}

TEST_F(IgtlExamples, AnotherTrackersToolIsNoNeedle) {
  IgtlBrachyd brachyd(folder.write("scene.toml", small_scene()));
  ChildProcess tracker(brachyd.client("TrackerClient", {"200"}));
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(read_matrix(tracker));
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.daemon.port));
  ASSERT_TRUE(viewer.refresh_state());
  EXPECT_EQ(viewer.states.back().poses_accepted, 0u);
  EXPECT_EQ(viewer.states.back().device_holder, "");
}

TEST_F(IgtlExamples, AReceiveClientGetsNeedleForceAndSurface) {
  IgtlBrachyd brachyd(still_scene());
  ChildProcess receiver(brachyd.client("ReceiveClient"));
  const auto needle = printed(at_rest), force = printed(RigidTransform{});
  int needles = 0, forces = 0;
  while (needles < 10 || forces < 10) {
    const auto matrix = read_matrix(receiver);
    ASSERT_TRUE(matrix);
    EXPECT_TRUE(*matrix == needle || *matrix == force) << (*matrix)[0] << "; " << (*matrix)[1];
    needles += *matrix == needle;
    forces += *matrix == force;  // nothing is touched
  }
  brachyd.daemon.process.send_signal(SIGTERM);
  const Ended ended = receiver.wait();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.err.find("Receiving : POLYDATA"), std::string::npos) << ended.err.substr(0, 2000);
  EXPECT_NE(ended.err.find("Status    : the server stops"), std::string::npos);
}

TEST_F(IgtlExamples, ATrackingDataClientStartsAndStopsTheStream) {
  IgtlBrachyd brachyd(still_scene());
  ChildProcess client(brachyd.client("TrackingDataClient", {"50"}));
  for (int i = 0; i < 9; ++i) {  // the tenth message that it counts is our answer to its first
    const auto matrix = read_matrix(client);
    ASSERT_TRUE(matrix);
    EXPECT_EQ(*matrix, printed(at_rest));
  }
  ASSERT_TRUE(client.says("Sending STP_TDATA"));
  ASSERT_TRUE(client.says("RTS_TDATA", 2));
  brachyd.daemon.process.send_signal(SIGTERM);
  const Ended ended = client.wait();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.err.find("Name       : NeedleToRas"), std::string::npos) << ended.err.substr(0, 2000);
  EXPECT_EQ(ended.err.find("POLYDATA"), std::string::npos) << "it asked for tracking data alone";
}

TEST_F(IgtlExamples, APolyDataClientGetsTheSurfacePointForPoint) {
  IgtlBrachyd brachyd(folder.write("scene.toml", small_scene()));
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.daemon.port));
  const Ended ended = run_process(brachyd.client("PolyDataClient"));
  ASSERT_TRUE(exited(ended, 0)) << ended.err.substr(0, 2000);
  ASSERT_TRUE(viewer.until([&] { return !viewer.topology.rest_vertices.empty(); }));
  EXPECT_EQ(ended.err.find("Invalid response"), std::string::npos);
  std::ostringstream expected;
  const auto& rest = viewer.topology.rest_vertices;
  expected << "  ------ Points ------\n";
  for (std::size_t i = 0; i < viewer.topology.surface_vertex_count; ++i)
    expected << "  point[" << i << "] = (" << rest[3 * i] << ", " << rest[3 * i + 1] << ", "
             << rest[3 * i + 2] << ")\n";
  expected << "  ------ Polygons ------\n";
  const auto& triangles = viewer.topology.triangles;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    // The example prints a cell's first corner twice.
    expected << "  cell[" << i << "] = (" << triangles[i][0];
    for (const std::uint32_t corner : triangles[i]) expected << ", " << corner;
    expected << ")\n";
  }
  std::size_t answers = 0;
  const auto lines = [](std::string text) {  // of the arrays that are there
    for (const char* empty :
         {"  ------ Vertices ------\n", "  ------ Lines ------\n", "  ------ TriangleStrips ------\n"})
      for (std::size_t at; (at = text.find(empty)) != std::string::npos;)
        text.erase(at, std::string(empty).size());
    return text;
  };
  const std::string all = lines(ended.err);
  for (std::size_t at = 0; (at = all.find(expected.str(), at)) != std::string::npos; ++at) ++answers;
  EXPECT_EQ(answers, 10u);
}

}  // namespace
}  // namespace brachy
