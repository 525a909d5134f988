// Stand-ins for 3D Slicer and PLUS: OpenIGTLink in, OpenIGTLink out, beside native clients.
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "haptics/devices/pose_guard.h"
#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/codec.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_daemon.h"
#include "tests/net/igtl/igtl_peer.h"

namespace brachy {
namespace {

using namespace test;
using net::igtl::StatusCode;
using net::igtl::test::IgtlPeer;

Scene small_with_igtl() {
  Scene scene = small();
  scene.server.igtl_port = 0;
  return scene;
}

struct DaemonIgtl : ::testing::Test {
  /// Serves the viewer and reads the messages to the others, until `condition()`.
  template <class Condition>
  bool until(Condition&& condition) {
    return viewer.until([&] {
      for (IgtlPeer* peer : {&device, &listener}) peer->take();
      return condition();
    });
  }
  /// Sends the pose and waits until the simulation has it.
  bool show(const RigidTransform& X_WN) {
    const Vec3 p = X_WN.p.cast<float>().cast<double>();
    return device.send_pose("NeedleToRas", X_WN) && until([&] {
             return !viewer.frames.empty() && viewer.needle().present && viewer.needle().X_WN.p == p;
           });
  }
  std::vector<float> surface_of_viewer() const {
    const auto& all = viewer.last().positions;
    return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(3 * viewer.topology.surface_vertex_count)};
  }

  RunningDaemon daemon{small_with_igtl()};
  boost::asio::io_context io;
  Peer viewer{net::Role::kViewer, 0, true};
  IgtlPeer device{io, daemon.igtl_port()}, listener{io, daemon.igtl_port()};
};

TEST_F(DaemonIgtl, ANeedlesTransformGoesInAndSurfaceAndForceComeOutAsTheSimulationHasThem) {
  ASSERT_TRUE(viewer.join(daemon.port()));
  for (const RigidTransform& X_WN : way_in()) ASSERT_TRUE(show(X_WN));
  ASSERT_EQ(viewer.needle().contact, ContactState::kInserted);
  // Nothing moves any more: the last message is the same for all.
  ASSERT_TRUE(until([&] {
    if (listener.count("POLYDATA") == 0 || listener.count("TRANSFORM", "ForceToRas") == 0) return false;
    const Vec3 force_n = viewer.needle().forces.force_n.cast<float>().cast<double>();
    return listener.last("POLYDATA").points() == surface_of_viewer() &&
           listener.last("TRANSFORM", "ForceToRas").transform().p == force_n;
  })) << "force "
      << listener.last("TRANSFORM", "ForceToRas").transform().p.transpose() << ", simulated "
      << viewer.needle().forces.force_n.transpose();
  EXPECT_GT(viewer.needle().forces.force_n.norm(), 1);
  EXPECT_GT(viewer.last().message.max_displacement_mm, 1);
  const RigidTransform needle = listener.last("TRANSFORM", "NeedleToRas").transform();
  EXPECT_EQ(needle.R, Mat3::Identity());
  EXPECT_EQ(needle.p, viewer.needle().X_WN.p);
  EXPECT_EQ(device.count("TRANSFORM", "NeedleToRas"), 0u) << "its own pose is not sent back";

  // It renders no force, so when it leaves in contact nothing is latched for the next device.
  device.close();
  ASSERT_TRUE(viewer.until([&] {
    return !viewer.events.empty() && viewer.events.back().kind == net::EventKind::kDeviceDetached;
  }));
  for (const auto& event : viewer.events) EXPECT_NE(event.kind, net::EventKind::kSafety) << event.text;
}

TEST_F(DaemonIgtl, PosesThatAreNoneAreRefusedByTheGuard) {
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(show(tip_at(8, -4, -34)));
  RigidTransform scaled = tip_at(8, -4, -34);
  scaled.R *= 2;
  ASSERT_TRUE(device.send_pose("NeedleToRas", scaled));
  ASSERT_TRUE(until([&] { return device.count("STATUS") == 1; }));
  EXPECT_EQ(device.last("STATUS").status().sub_code, static_cast<int>(PoseStatus::kNotRigid));
  ASSERT_TRUE(device.send_pose("NeedleToRas", tip_at(std::numeric_limits<double>::quiet_NaN(), 0, 0)));
  ASSERT_TRUE(until([&] { return device.count("STATUS") == 2; }));
  EXPECT_EQ(device.last("STATUS").status().sub_code, static_cast<int>(PoseStatus::kNotFinite));
  ASSERT_TRUE(viewer.refresh_state());
  EXPECT_TRUE(viewer.states.back().safety.empty());
  EXPECT_EQ(viewer.needle().X_WN.p, Vec3(8, -4, -34));
}

TEST_F(DaemonIgtl, WhoComesSecondIsToldWhoHasTheNeedle) {
  Peer native(net::Role::kDevice, 0, false, "touch");
  ASSERT_TRUE(native.join(daemon.port()));
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(device.send_pose("NeedleToRas", tip_at(8, -4, -34)));
  ASSERT_TRUE(until([&] { return device.count("STATUS") == 1; }));
  EXPECT_EQ(device.last("STATUS").status().code, StatusCode::kBusy);
  EXPECT_NE(device.last("STATUS").status().text.find("touch (127.0.0.1:"), std::string::npos);

  native.client.close();
  ASSERT_TRUE(until([&] {
    return !viewer.events.empty() && viewer.events.back().kind == net::EventKind::kDeviceDetached;
  }));
  ASSERT_TRUE(show(tip_at(8, -4, -34)));
  Peer late(net::Role::kDevice, 0, false, "late");
  EXPECT_FALSE(late.join(daemon.port()));
  ASSERT_FALSE(late.errors.empty());
  EXPECT_NE(late.errors[0].text.find("NeedleToRas (OpenIGTLink 127.0.0.1:"), std::string::npos);
}

TEST_F(DaemonIgtl, TheDaemonsEndIsToldToItsClients) {
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(show(tip_at(8, -4, -34)));
  daemon.stop();
  listener.take();
  EXPECT_TRUE(listener.is_ended());
  EXPECT_EQ(listener.last("STATUS").status().code, StatusCode::kShutdown);
}

net::Bytes string_message(const std::string& words) {
  net::Bytes message = net::igtl::encode_empty("STRING", {1, "Slicer", 0});
  net::igtl::put(message, std::uint16_t{3});
  net::igtl::put(message, static_cast<std::uint16_t>(words.size()));
  net::igtl::put_name(message, words, words.size());
  return net::igtl::test::with_right_size_and_crc(message);
}

// Another's device holds the needle, and a model does not fit: the native operator is refused both.
TEST(DaemonIgtlCommands, WhatTheNativeProtocolRefusesIsRefusedHereToo) {
  Scene scene = small_with_igtl();
  scene.server.igtl_commands = true;
  scene.box.size_mm = Vec3::Constant(30);  // the gland does not fit
  RunningDaemon daemon(scene);
  Peer holder(net::Role::kDevice), native(net::Role::kOperator);
  holder.stand_beside(native);
  ASSERT_TRUE(holder.join(daemon.port()) && native.join(daemon.port()));
  ASSERT_TRUE(holder.show(tip_at(8, -4, -34)));
  boost::asio::io_context io;
  IgtlPeer slicer(io, daemon.igtl_port());
  const auto status_of = [&](const char* words) {
    const std::size_t before = slicer.count("STATUS");
    EXPECT_TRUE(slicer.send(string_message(words)));
    EXPECT_TRUE(holder.until([&] {
      slicer.take();
      return slicer.count("STATUS") > before;
    }));
    return slicer.last("STATUS").status();
  };
  const auto native_refusal = [&](const auto& message) {
    const std::size_t before = native.errors.size();
    native.client.send(message);
    EXPECT_TRUE(holder.until([&] { return native.errors.size() > before; }));
    return native.errors.back().text;
  };
  const auto dropped = status_of("drop 0");
  EXPECT_EQ(dropped.code, StatusCode::kIllegalInstruction);
  EXPECT_EQ(dropped.text, native_refusal(net::DropMessage{0, true}));
  net::ControlMessage model;
  model.action = net::ControlAction::kModel;
  model.kernel = "elastic";
  const auto unfit = status_of("model elastic");
  EXPECT_EQ(unfit.code, StatusCode::kIllegalInstruction);
  EXPECT_EQ(unfit.text, native_refusal(model));
  EXPECT_EQ(status_of("reset").code, StatusCode::kOk);
  EXPECT_EQ(daemon.stop().seeds_dropped, 0u);
}

}  // namespace
}  // namespace brachy
