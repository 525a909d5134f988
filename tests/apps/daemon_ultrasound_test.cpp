// The daemon's ultrasound: images of what the simulation does, at the settings in use, over both protocols.
#include <gtest/gtest.h>

#include <algorithm>

#include "net/wire/image_pixels.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_daemon.h"
#include "tests/net/igtl/igtl_peer.h"

namespace brachy {
namespace {

using namespace test;
using net::ScannerArray;
using net::ScannerMessage;

Scene scanned() {
  Scene scene = small();
  scene.server.igtl_port = 0;
  scene.ultrasound.width_px = scene.ultrasound.height_px = 128;
  scene.ultrasound.lines = 64;
  return scene;
}

struct DaemonUltrasound : ::testing::Test {
  bool ask(const ScannerMessage& request) {
    const std::size_t before = boss.scanners.size();
    boss.client.send(request);
    return boss.until([&] { return boss.scanners.size() > before; });
  }
  /// The next image that satisfies `condition`.
  template <class Condition>
  bool until_image(Condition&& condition) {
    return boss.until([&] { return !boss.images.empty() && condition(boss.images.back()); });
  }
  static double mean(const net::ImageMessage& image) {
    double sum = 0;
    for (const std::uint8_t gray : image.data) sum += gray;
    return sum / static_cast<double>(image.data.size());
  }

  RunningDaemon daemon{scanned()};
  Peer boss{net::Role::kOperator, net::kSubscribeUltrasound};
};

TEST_F(DaemonUltrasound, ImagesComeToWhoSubscribedAndShowTheNewestTicks) {
  Peer older;
  older.stand_beside(boss);
  ASSERT_TRUE(older.join(daemon.port()));
  ASSERT_TRUE(boss.join(daemon.port()));
  ASSERT_TRUE(boss.until([&] { return boss.images.size() >= 5 && older.frames.size() > 5; }));
  EXPECT_TRUE(older.images.empty());
  ASSERT_FALSE(boss.scanners.empty());
  EXPECT_EQ(boss.scanners[0].array, ScannerArray::kTransverse);
  for (std::size_t i = 1; i < boss.images.size(); ++i) {
    EXPECT_GT(boss.images[i].sequence, boss.images[i - 1].sequence);
    EXPECT_GT(boss.images[i].tick, boss.images[i - 1].tick);
  }
  EXPECT_GT(mean(boss.images.back()), 10);
  const DaemonSummary& summary = daemon.stop();
  EXPECT_GE(summary.ultrasound.images, 5u);
  EXPECT_EQ(summary.ultrasound.image_ns.count(), summary.ultrasound.images);
}

TEST_F(DaemonUltrasound, NoneAreMadeWhileNobodySubscribed) {
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port()));
  ASSERT_TRUE(viewer.until([&] { return viewer.frames.size() > 20; }));
  EXPECT_EQ(daemon.stop().ultrasound.images, 0u);
}

TEST_F(DaemonUltrasound, SettingsTakeEffectWhileItRuns) {
  ASSERT_TRUE(boss.join(daemon.port()));
  ASSERT_TRUE(until_image([](const auto&) { return true; }));
  const double spacing = boss.images.back().spacing_mm, gray = mean(boss.images.back());
  ScannerMessage request;
  request.depth_mm = 100;
  request.gain_db = 15;
  ASSERT_TRUE(ask(request));
  EXPECT_EQ(boss.scanners.back().depth_mm, 100);
  ASSERT_TRUE(until_image([&](const auto& image) { return image.spacing_mm > 1.3 * spacing; }));
  EXPECT_GT(mean(boss.images.back()), gray);
  request = {};
  request.array = ScannerArray::kBiplane;
  ASSERT_TRUE(ask(request));
  ASSERT_TRUE(until_image([](const auto& image) { return image.array == ScannerArray::kSagittal; }));
  ASSERT_TRUE(until_image([](const auto& image) { return image.array == ScannerArray::kTransverse; }));
  request = {};
  request.depth_mm = 5;
  boss.client.send(request);
  ASSERT_TRUE(boss.until([&] { return !boss.errors.empty(); }));
  EXPECT_EQ(boss.errors[0].code, net::ErrorCode::kScannerRefused);
}

TEST_F(DaemonUltrasound, AFrozenScannerSendsItsLastImageOnceAndToWhoComesLater) {
  ASSERT_TRUE(boss.join(daemon.port()));
  ASSERT_TRUE(until_image([](const auto&) { return true; }));
  ScannerMessage request;
  request.freeze = net::ScannerFreeze::kFrozen;
  ASSERT_TRUE(ask(request));
  ASSERT_TRUE(until_image([](const auto& image) { return (image.flags & net::kImageFrozen) != 0; }));
  const net::ImageMessage frozen = boss.images.back();
  Peer later{net::Role::kViewer, net::kSubscribeUltrasound};
  later.stand_beside(boss);
  ASSERT_TRUE(later.join(daemon.port()));
  ASSERT_TRUE(later.until([&] { return !later.images.empty(); }));
  EXPECT_EQ(later.images[0].data, frozen.data);
  request.freeze = net::ScannerFreeze::kLive;
  ASSERT_TRUE(ask(request));
  ASSERT_TRUE(until_image([&](const auto& image) { return image.flags == 0 && image.tick > frozen.tick; }));
}

TEST_F(DaemonUltrasound, GoesOnAfterAResetAndWithAnotherModel) {
  ASSERT_TRUE(boss.join(daemon.port()));
  ASSERT_TRUE(until_image([](const auto& image) { return image.tick > 20; }));
  net::ControlMessage control;
  control.action = net::ControlAction::kReset;
  const std::uint64_t before = boss.images.back().tick;
  boss.client.control(control);
  ASSERT_TRUE(until_image([&](const auto& image) { return image.tick < before && image.flags == 0; }));
  control.action = net::ControlAction::kModel;
  control.support_radius_mm = 18;
  boss.client.control(control);
  ASSERT_TRUE(boss.until([&] {
    return std::ranges::any_of(boss.states, [](const auto& s) { return s.controls.support_radius_mm == 18; });
  }));
  const std::uint64_t then = boss.images.back().tick;
  ASSERT_TRUE(until_image([&](const auto& image) { return image.tick > then + 10 && image.flags == 0; }));
}

TEST_F(DaemonUltrasound, OpenIgtLinkHasTheSameImageInItsPlace) {
  boost::asio::io_context io;
  net::igtl::test::IgtlPeer slicer(io, daemon.igtl_port());
  ASSERT_TRUE(boss.join(daemon.port()));
  // It gets messages of every tick, and who does not read for long is closed.
  const auto until = [&](auto&& condition) {
    return boss.until([&] {
      slicer.take();
      return condition();
    });
  };
  ASSERT_TRUE(until([&] { return !boss.images.empty(); }));
  ScannerMessage request;
  request.probe_rotation_deg = 20;
  request.probe_depth_mm = 5;
  ASSERT_TRUE(ask(request));
  RigidTransform moving;
  ASSERT_TRUE(until([&] {  // it has arrived
    const net::ImageMessage& image = boss.images.back();
    const bool is_still = image.X_WI == moving && image.X_WI.R(1, 0) != 0;
    moving = image.X_WI;
    return is_still && boss.images.size() > 40;
  }));
  request = {};
  request.freeze = net::ScannerFreeze::kFrozen;
  ASSERT_TRUE(ask(request));
  ASSERT_TRUE(slicer.send_query("GET_IMAGE", "UltrasoundTransverse"));
  ASSERT_TRUE(until(
      [&] { return slicer.count("IMAGE") == 1 && (boss.images.back().flags & net::kImageFrozen) != 0; }));
  const net::ImageMessage& ours = boss.images.back();
  const net::Bytes expected = net::igtl::encode_image({1, "UltrasoundTransverse", 0}, ours);
  const auto& content = slicer.last("IMAGE").content;
  EXPECT_TRUE(std::ranges::equal(content, std::span(expected).subspan(net::igtl::kHeaderSize)));
}

}  // namespace
}  // namespace brachy
