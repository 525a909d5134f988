// OpenIGTLink's own example servers (Debian's openigtlink-examples) as trackers and surfaces. brachyd is a server
// itself, so the test is a client of both, as 3D Slicer is, and forwards the messages.
#include <gtest/gtest.h>

#include <algorithm>

#include "net/igtl/codec/big_endian.h"
#include "test_paths.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"
#include "tests/net/igtl/igtl_peer.h"

namespace brachy {
namespace {

using namespace test;
using namespace net::igtl;
using net::Bytes;
using net::igtl::test::IgtlPeer;
using net::igtl::test::Received;

std::uint16_t port_in(const std::optional<std::string>& line, std::string_view says) {
  if (line && line->starts_with(says))
    return static_cast<std::uint16_t>(std::stoi(line->substr(says.size())));
  ADD_FAILURE() << "no \"" << says << "\" but " << line.value_or("nothing");
  return 0;
}

/// One of the example servers on a free port of the loopback.
struct ExampleServer {
  explicit ExampleServer(const std::string& name, const std::vector<std::string>& more = {})
      : process(command(name, more)), port(port_in(process.read_line(), "bound to port ")) {}
  static std::vector<std::string> command(const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> line = {"/usr/bin/env", "LD_PRELOAD=" IGTL_LOOPBACK_BIND,
                                     std::string(IGTL_EXAMPLES_DIR) + "/" + name, "0"};
    line.insert(line.end(), more.begin(), more.end());
    return line;
  }
  ChildProcess process;
  std::uint16_t port;
};

Bytes start_tracking(std::uint32_t resolution_ms) {
  Bytes message = encode_empty("STT_TDATA", {1, "", 0});
  put(message, resolution_ms);
  message.resize(message.size() + 32);  // of any coordinate system
  return net::igtl::test::with_right_size_and_crc(std::move(message));
}

struct IgtlServers : ::testing::Test {
  std::string scene(int needles) {
    return folder.write(
        "scene.toml",
        small_scene("[device]\nstale_pose_ms = 60000\n[needle]\ncount = " + std::to_string(needles) + "\n"));
  }
  TempFolder folder;
  boost::asio::io_context io;
};

struct Brachyd {
  explicit Brachyd(const std::string& scene)
      : daemon(scene, {"--igtl-port", "0"}),
        igtl_port(port_in(daemon.process.read_line(), "{\"igtl_on\":\"127.0.0.1:")) {}
  RunningBrachyd daemon;
  std::uint16_t igtl_port;
};

TEST_F(IgtlServers, ATrackerServersTransformsMoveTheNeedle) {
  const ExampleServer server("TrackerServer", {"100"});
  const Brachyd brachyd(scene(1));
  IgtlPeer tracker(io, server.port), needle(io, brachyd.igtl_port);
  Peer viewer(net::Role::kViewer, net::kSubscribePoseHistory);
  ASSERT_TRUE(viewer.join(brachyd.daemon.port));
  std::size_t handed_on = 0;
  ASSERT_TRUE(viewer.until([&] {
    tracker.take();
    for (; handed_on < tracker.received.size(); ++handed_on)
      needle.send_pose("NeedleToRas", tracker.received[handed_on].transform());
    return viewer.poses.size() >= 50;
  }));
  for (const auto& [tick, X_WN] : viewer.poses)
    EXPECT_TRUE(std::ranges::any_of(tracker.received,
                                    [&, p = X_WN.p](const Received& sent) {
                                      return sent.header.type == "TRANSFORM" &&
                                             sent.header.device == "Tracker" && sent.transform().p == p;
                                    }))
        << "tick " << tick;
}

TEST_F(IgtlServers, ATrackingDataServersChannelsAreNeedlesAndComeBackAsTrackingData) {
  const ExampleServer server("TrackingDataServer");
  const Brachyd brachyd(scene(3));
  IgtlPeer tracker(io, server.port), needles(io, brachyd.igtl_port), reader(io, brachyd.igtl_port);
  ASSERT_TRUE(tracker.send(start_tracking(20)));
  ASSERT_TRUE(reader.send(start_tracking(20)));
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.daemon.port));
  std::size_t handed_on = 0;
  ASSERT_TRUE(viewer.until([&] {
    tracker.take();
    for (; handed_on < std::min<std::size_t>(tracker.received.size(), 20); ++handed_on) {
      const auto channels = tracker.received[handed_on].tools();
      for (std::size_t i = 0; i < channels.size(); ++i)
        needles.send_pose("Needle" + std::to_string(i) + "ToRas", channels[i].X);
    }
    return handed_on == 20;
  }));
  const auto sent = tracker.received[19].tools();
  ASSERT_EQ(sent.size(), 3u);
  EXPECT_EQ(sent[2].name, "Channel 2");
  EXPECT_TRUE(viewer.until([&] {
    reader.take();
    if (reader.count("TDATA") == 0) return false;
    const auto got = reader.last("TDATA").tools();
    return std::ranges::equal(
        sent, got, [](const TrackedTool& a, const TrackedTool& b) { return (a.X.p - b.X.p).norm() < 1e-5; });
  }));
  EXPECT_EQ(reader.last("TDATA").tools().at(1).name, "Needle1ToRas");
  EXPECT_EQ(needles.count("STATUS"), 0u);
}

TEST_F(IgtlServers, APolyDataServersSurfaceIsReadAndHandedOnHarmsNothing) {
  const ExampleServer server("PolyDataServer");
  const Brachyd brachyd(scene(1));
  IgtlPeer model(io, server.port), slicer(io, brachyd.igtl_port);
  ASSERT_TRUE(model.send_query("GET_POLYDATA", "cube"));
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.daemon.port));
  ASSERT_TRUE(viewer.until([&] {
    model.take();
    return model.count("POLYDATA", "cube") == 1;
  }));
  const std::vector<float> cube = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
  EXPECT_EQ(model.last("POLYDATA").points(), cube);

  Bytes message = encode_empty("POLYDATA", {1, "cube", 0});
  const Bytes& content = model.last("POLYDATA").content;
  message.insert(message.end(), content.begin(), content.end());
  ASSERT_TRUE(slicer.send(net::igtl::test::with_right_size_and_crc(std::move(message))));
  ASSERT_TRUE(slicer.send_query("GET_POLYDATA"));
  ASSERT_TRUE(viewer.until([&] {
    slicer.take();
    return slicer.count("POLYDATA") > 0 && !viewer.topology.rest_vertices.empty();
  }));
  const auto& rest = viewer.topology.rest_vertices;
  const auto end = rest.begin() + 3 * static_cast<std::ptrdiff_t>(viewer.topology.surface_vertex_count);
  EXPECT_EQ(slicer.last("POLYDATA").points(), std::vector<float>(rest.begin(), end));
}

}  // namespace
}  // namespace brachy
