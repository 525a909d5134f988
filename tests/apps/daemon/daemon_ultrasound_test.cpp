// The daemon's ultrasound: images of what the simulation does, at the settings in use, over both protocols.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

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
  void join_and_freeze() {
    ASSERT_TRUE(boss.join(daemon.port()));
    ASSERT_TRUE(until_image([](const auto&) { return true; }));
    ScannerMessage request;
    request.freeze = net::ScannerFreeze::kFrozen;
    ASSERT_TRUE(ask(request));
    ASSERT_TRUE(until_image([](const auto& image) { return (image.flags & net::kImageFrozen) != 0; }));
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
  ASSERT_NO_FATAL_FAILURE(join_and_freeze());
  const net::ImageMessage frozen = boss.images.back();
  Peer later{net::Role::kViewer, net::kSubscribeUltrasound};
  later.stand_beside(boss);
  ASSERT_TRUE(later.join(daemon.port()));
  ASSERT_TRUE(later.until([&] { return !later.images.empty(); }));
  EXPECT_EQ(later.images[0].data, frozen.data);
  ScannerMessage request;
  request.freeze = net::ScannerFreeze::kLive;
  ASSERT_TRUE(ask(request));
  ASSERT_TRUE(until_image([&](const auto& image) { return image.flags == 0 && image.tick > frozen.tick; }));
}

TEST_F(DaemonUltrasound, AScannerFrozenBeforeItsFirstImageFreezesThatOne) {
  Peer early{net::Role::kOperator};
  ASSERT_TRUE(early.join(daemon.port()));
  ScannerMessage request;
  request.freeze = net::ScannerFreeze::kFrozen;
  early.client.send(request);
  ASSERT_TRUE(early.refresh_state());
  Peer later{net::Role::kViewer, net::kSubscribeUltrasound};
  later.stand_beside(early);
  ASSERT_TRUE(later.join(daemon.port()));
  ASSERT_TRUE(later.until(
      [&] { return !later.images.empty() && (later.images.back().flags & net::kImageFrozen) != 0; }));
}

TEST_F(DaemonUltrasound, WhoComesLaterGetsNoImageOfAnotherArrayOrOfLongAgo) {
  ASSERT_TRUE(boss.join(daemon.port()));
  ASSERT_TRUE(until_image([](const auto& image) { return image.array == ScannerArray::kTransverse; }));
  ScannerMessage request;
  request.array = ScannerArray::kSagittal;
  ASSERT_TRUE(ask(request));
  ASSERT_TRUE(until_image([](const auto& image) { return image.array == ScannerArray::kSagittal; }));
  Peer later{net::Role::kViewer, net::kSubscribeUltrasound};
  later.stand_beside(boss);
  ASSERT_TRUE(later.join(daemon.port()));
  ASSERT_TRUE(later.until([&] { return later.images.size() >= 3; }));
  for (const net::ImageMessage& image : later.images) EXPECT_EQ(image.array, ScannerArray::kSagittal);

  boss.client.close();
  later.client.close();
  Peer watcher;
  watcher.stand_beside(boss);
  ASSERT_TRUE(watcher.join(daemon.port()));
  do {
    ASSERT_TRUE(watcher.refresh_state());
  } while (watcher.states.back().clients > 1);
  const std::size_t seen = watcher.frames.size();
  ASSERT_TRUE(watcher.until([&] { return watcher.frames.size() > seen + 20; }));
  const std::uint64_t tick = watcher.last().message.tick;
  Peer last{net::Role::kViewer, net::kSubscribeUltrasound};
  ASSERT_TRUE(last.join(daemon.port()));
  ASSERT_TRUE(last.until([&] { return !last.images.empty(); }));
  EXPECT_GE(last.images[0].tick, tick) << "not of the time when somebody looked before";
}

TEST_F(DaemonUltrasound, GoesOnAfterAResetAndWithAnotherModel) {
  ASSERT_TRUE(boss.join(daemon.port()));
  ASSERT_TRUE(until_image([](const auto& image) { return image.tick > 20; }));
  net::ControlMessage control;
  control.action = net::ControlAction::kReset;
  const std::uint64_t before = boss.images.back().tick;
  boss.client.control(control);
  ASSERT_TRUE(until_image([&](const auto& image) { return image.tick < before && image.flags == 0; }));
  // An image may come before the snapshot that ends the reset; until then another change is refused.
  ASSERT_TRUE(boss.until([&] { return boss.has_event(net::EventKind::kReset); }));
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
  const net::Bytes expected = net::igtl::encode_image({1, "UltrasoundTransverse", 0}, ours, ours.X_WI);
  const auto& content = slicer.last("IMAGE").content;
  EXPECT_TRUE(std::ranges::equal(content, std::span(expected).subspan(net::igtl::kHeaderSize)));
}

/// An outline on the newest image: a square about the image's middle.
net::ContourSlice square_on(const net::ImageMessage& image, std::int32_t slice, double half_mm) {
  net::ContourSlice outline;
  outline.slice = slice;
  outline.tick = image.tick;
  outline.X_WI = image.X_WI;
  const double x = 0.5 * image.spacing_mm * image.width, y = 0.5 * image.spacing_mm * image.height;
  outline.points = {{x - half_mm, y - half_mm},
                    {x + half_mm, y - half_mm},
                    {x + half_mm, y + half_mm},
                    {x - half_mm, y + half_mm}};
  return outline;
}

TEST_F(DaemonUltrasound, AnOutlinedGlandIsScoredAgainstWhereTheFieldHadIt) {
  ASSERT_NO_FATAL_FAILURE(join_and_freeze());
  net::ContourMessage study;
  study.slices.push_back(square_on(boss.images.back(), 7, 5));
  boss.client.send(study);
  ASSERT_TRUE(boss.until([&] { return !boss.contours.empty(); }));
  const net::ContourMessage first = boss.contours.back();
  ASSERT_TRUE(first.score);
  EXPECT_GT(first.about_sequence, 0u);
  EXPECT_NEAR(first.score->planes.at(0).outlined_mm2, 100, 1e-9);
  EXPECT_EQ(first.score->planes[0].slice, 7);
  ASSERT_EQ(first.slices.size(), 1u);
  EXPECT_EQ(first.slices[0].tick, study.slices[0].tick);

  // What it says the gland was is a perfect outline.
  study.slices[0].points = first.slices[0].points;
  boss.client.send(study);
  ASSERT_TRUE(boss.until([&] { return boss.contours.size() == 2; }));
  const net::ContourMessage::Figures& score = *boss.contours[1].score;
  EXPECT_NEAR(score.dice, 1, 1e-9);
  EXPECT_NEAR(score.hausdorff_mm, 0, 1e-9);
  EXPECT_NEAR(score.true_cm3, first.score->true_cm3, 1e-12);
  EXPECT_GT(score.true_cm3, 10);
}

struct ForeignPlane : DaemonUltrasound, ::testing::WithParamInterface<const char*> {};
TEST_P(ForeignPlane, OfAnOutlineIsRefused) {  // one a daemon, which takes one CONTOUR a second
  ASSERT_NO_FATAL_FAILURE(join_and_freeze());
  net::ContourMessage study;
  study.slices.push_back(square_on(boss.images.back(), 7, 5));
  RigidTransform& X_WI = study.slices[0].X_WI;
  const std::string what = GetParam();
  if (what == "Aside") X_WI.p += 0.01 * X_WI.R.col(2);
  if (what == "Turned") X_WI.R = X_WI.R * Eigen::AngleAxisd(1e-3, Vec3::UnitX());
  if (what == "NoNumber") X_WI.R(1, 1) = std::numeric_limits<double>::quiet_NaN();
  boss.client.send(study);
  ASSERT_TRUE(boss.until([&] { return !boss.errors.empty() || !boss.contours.empty(); }));
  ASSERT_TRUE(boss.contours.empty());
  EXPECT_EQ(boss.errors[0].code, net::ErrorCode::kContourRefused);
  EXPECT_NE(boss.errors[0].text.find("frozen in its plane"), std::string::npos) << boss.errors[0].text;
}
INSTANTIATE_TEST_SUITE_P(Each, ForeignPlane, ::testing::Values("Aside", "Turned", "NoNumber"),
                         [](const auto& value) { return std::string(value.param); });

TEST_F(DaemonUltrasound, AStudyOfAnImageThatWasNotFrozenIsRefused) {
  ASSERT_TRUE(boss.join(daemon.port()));
  ASSERT_TRUE(until_image([](const auto&) { return true; }));
  net::ContourMessage study;
  study.slices.push_back(square_on(boss.images.back(), 7, 5));
  boss.client.send(study);
  ASSERT_TRUE(boss.until([&] { return !boss.errors.empty(); }));
  EXPECT_EQ(boss.errors[0].code, net::ErrorCode::kContourRefused);
  EXPECT_NE(boss.errors[0].text.find("slice 7: no image of tick"), std::string::npos) << boss.errors[0].text;
  Peer viewer{net::Role::kViewer, net::kSubscribeUltrasound};
  viewer.stand_beside(boss);
  ASSERT_TRUE(viewer.join(daemon.port()));
  viewer.client.send(study);
  ASSERT_TRUE(viewer.until([&] { return !viewer.errors.empty(); }));
  EXPECT_EQ(viewer.errors[0].code, net::ErrorCode::kNotOperator);
}

}  // namespace
}  // namespace brachy
