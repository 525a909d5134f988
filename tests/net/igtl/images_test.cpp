// IMAGE over OpenIGTLink: for those that ask, and for nobody else.
#include <gtest/gtest.h>

#include "net/igtl/content/image_messages.h"
#include "net/igtl/igtl_server.h"
#include "tests/net/igtl/igtl_peer.h"
#include "tests/net/net_testing.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::igtl::test {
namespace {

using net::test::ServerFixture;

struct IgtlImages : ServerFixture {
  IgtlImages() {
    ServerOptions options;
    options.has_ultrasound = true;
    start(options);
    igtl = std::make_unique<IgtlServer>(io, IgtlOptions{}, *server, tissue, [](const std::string&) {});
  }
  void publish_image(ScannerArray array, std::uint8_t gray) {
    auto image = std::make_shared<ImageMessage>(net::test::sample_image());
    image->array = array;
    image->flags = 0;
    image->publish_ns = clock.now_ns();
    image->data.assign(6, gray);
    igtl->publish_image(image);
  }
  template <class Condition>
  bool until_of(IgtlPeer& peer, Condition&& condition) {
    return until([&] {
      peer.take();
      return condition();
    });
  }
  static std::uint8_t gray_of(const Received& image) {
    return std::to_integer<std::uint8_t>(image.content.back());
  }

  std::unique_ptr<IgtlServer> igtl;
};

TEST_F(IgtlImages, GetImageIsAnsweredOnceByTheNextImage) {
  IgtlPeer peer(io, igtl->port());
  EXPECT_FALSE(igtl->wants_images());
  ASSERT_TRUE(peer.send_query("GET_IMAGE", "UltrasoundSagittal"));
  ASSERT_TRUE(until([&] { return igtl->wants_images(); }));
  publish_image(ScannerArray::kTransverse, 3);
  EXPECT_TRUE(igtl->wants_images()) << "that was another array's";
  publish_image(ScannerArray::kSagittal, 5);
  EXPECT_FALSE(igtl->wants_images());
  publish_image(ScannerArray::kSagittal, 7);
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("IMAGE") == 1; }));
  EXPECT_EQ(peer.last("IMAGE").header.device, "UltrasoundSagittal");
  // A second one shows that nothing came between.
  ASSERT_TRUE(peer.send_query("GET_STATUS"));
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(peer.count("IMAGE"), 1u);
}

// As all that is sent: POLYDATA beside it is in that frame.
TEST_F(IgtlImages, AnImageLiesInTheScenesFrame) {
  IgtlOptions options;
  options.naming.frame = "Reference";
  options.naming.X_WF.R = Eigen::AngleAxisd(0.7, Vec3(2, -1, 2) / 3).toRotationMatrix();
  options.naming.X_WF.p = Vec3(12.5, -40, 8);
  igtl.reset();
  igtl = std::make_unique<IgtlServer>(io, options, *server, tissue, [](const std::string&) {});
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_IMAGE"));
  ASSERT_TRUE(until([&] { return igtl->wants_images(); }));
  publish_image(ScannerArray::kTransverse, 3);
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("IMAGE") == 1; }));
  const ImageMessage image = net::test::sample_image();
  const auto X_FI = decode_transform(std::span<const std::byte>(peer.last("IMAGE").content).subspan(12, 48));
  const Vec3 p_I(0.5 * image.spacing_mm * (image.width - 1), 0.5 * image.spacing_mm * (image.height - 1), 0);
  const Mat3& R_WF = options.naming.X_WF.R;
  EXPECT_LT((X_FI->p - R_WF.transpose() * (image.X_WI * p_I - options.naming.X_WF.p)).norm(), 1e-4);
  EXPECT_LT((X_FI->R - image.spacing_mm * R_WF.transpose() * image.X_WI.R).norm(), 1e-6);
}

TEST_F(IgtlImages, SttImageStreamsUntilStpImage) {
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("STT_IMAGE"));
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("RTS_IMAGE") == 1; }));
  for (std::uint8_t gray = 1; gray <= 3; ++gray)
    for (const ScannerArray array : {ScannerArray::kTransverse, ScannerArray::kSagittal}) {
      publish_image(array, gray);
      ASSERT_TRUE(until_of(peer, [&] {
        const std::string name(image_name(array));
        return peer.count("IMAGE", name) == gray && gray_of(peer.last("IMAGE", name)) == gray;
      }));
    }
  ASSERT_TRUE(peer.send_query("STP_IMAGE"));
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("RTS_IMAGE") == 2; }));
  EXPECT_FALSE(igtl->wants_images());
  publish_image(ScannerArray::kTransverse, 9);
  ASSERT_TRUE(peer.send_query("GET_STATUS"));
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(peer.count("IMAGE"), 6u);
}

TEST_F(IgtlImages, NobodyElseGetsThem) {
  IgtlPeer silent(io, igtl->port()), asking(io, igtl->port());
  ASSERT_TRUE(asking.send_query("STT_IMAGE"));
  ASSERT_TRUE(until_of(asking, [&] { return asking.count("RTS_IMAGE") == 1; }));
  publish_image(ScannerArray::kTransverse, 1);
  ASSERT_TRUE(until_of(asking, [&] { return asking.count("IMAGE") == 1; }));
  publish();
  simulation.step();
  igtl->publish(simulation.snapshot());
  ASSERT_TRUE(until_of(silent, [&] { return silent.count("POLYDATA") > 0; })) << "the stream";
  EXPECT_EQ(silent.count("IMAGE"), 0u);
}

// What is in use at the scanner, as the console publishes it.
ScannerMessage set_to(ScannerArray array, ScannerFreeze freeze) {
  ScannerMessage scanner;
  scanner.array = array;
  scanner.freeze = freeze;
  return scanner;
}

TEST_F(IgtlImages, AFrozenImageIsSentAgainAtOnceButAnOldOneIsNot) {
  auto image = std::make_shared<ImageMessage>(net::test::sample_image());
  image->array = ScannerArray::kTransverse;
  image->publish_ns = 1;  // long ago
  image->flags = 0;
  igtl->publish_image(image);
  IgtlPeer peer(io, igtl->port());
  ASSERT_TRUE(peer.send_query("GET_IMAGE"));
  ASSERT_TRUE(until([&] { return igtl->wants_images(); })) << "the old one does not do";
  EXPECT_EQ(igtl->images_asked(), 1u) << "for a frozen one again";
  igtl->set_scanner(set_to(ScannerArray::kTransverse, ScannerFreeze::kFrozen));
  image = std::make_shared<ImageMessage>(*image);
  image->flags = kImageFrozen;
  igtl->publish_image(image);
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("IMAGE") == 1; }));
  ASSERT_TRUE(peer.send_query("GET_IMAGE"));
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("IMAGE") == 2; }));
  // Its time says how old it is.
  EXPECT_LT(peer.last("IMAGE").header.timestamp, to_timestamp(clock.utc_ns()) - to_timestamp(1'000'000'000));
}

// Set free while nobody watched, or another array: it is not what the scanner shows, however it was flagged.
TEST_F(IgtlImages, AFrozenImageOfBeforeAnswersNothing) {
  auto image = std::make_shared<ImageMessage>(net::test::sample_image());
  image->array = ScannerArray::kTransverse;
  image->flags = kImageFrozen;
  igtl->set_scanner(set_to(ScannerArray::kTransverse, ScannerFreeze::kFrozen));
  igtl->publish_image(image);
  IgtlPeer peer(io, igtl->port());
  igtl->set_scanner(set_to(ScannerArray::kTransverse, ScannerFreeze::kLive));
  ASSERT_TRUE(peer.send_query("GET_IMAGE"));
  ASSERT_TRUE(until([&] { return igtl->wants_images(); })) << "the next one is waited for";
  publish_image(ScannerArray::kTransverse, 7);
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("IMAGE") == 1; }));
  EXPECT_EQ(gray_of(peer.last("IMAGE")), 7);

  igtl->publish_image(image);
  igtl->set_scanner(set_to(ScannerArray::kSagittal, ScannerFreeze::kFrozen));
  ASSERT_TRUE(peer.send_query("GET_IMAGE", "UltrasoundTransverse"));
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("STATUS") == 1; }));
  EXPECT_EQ(peer.last("STATUS").status().code, StatusCode::kNotPresent);
  EXPECT_EQ(peer.last("STATUS").status().text,
            "UltrasoundTransverse is of an array that is not in use: the scanner shows UltrasoundSagittal");
  ASSERT_TRUE(peer.send_query("GET_IMAGE", "Camera"));
  ASSERT_TRUE(until_of(peer, [&] { return peer.count("STATUS") == 2; }));
  EXPECT_EQ(peer.last("STATUS").status().text.substr(0, 24), "there is no image Camera");
  EXPECT_EQ(peer.count("IMAGE"), 1u);
}

TEST_F(IgtlImages, AServerWithoutUltrasoundSaysSoAtOnce) {
  igtl.reset();
  start();
  igtl = std::make_unique<IgtlServer>(io, IgtlOptions{}, *server, tissue, [](const std::string&) {});
  IgtlPeer peer(io, igtl->port());
  std::size_t refused = 0;
  for (const char* query : {"GET_IMAGE", "STT_IMAGE"}) {
    ASSERT_TRUE(peer.send_query(query));
    ASSERT_TRUE(until_of(peer, [&] { return peer.count("STATUS") == refused + 1; }));
    ++refused;
    EXPECT_EQ(peer.last("STATUS").status().text, kNoScanner) << query;
  }
  EXPECT_EQ(peer.last("RTS_IMAGE").content.front(), std::byte{1}) << "1: not done";
  EXPECT_FALSE(igtl->wants_images());
}

}  // namespace
}  // namespace brachy::net::igtl::test
