// Ultrasound: IMAGE and SCANNER go to those that asked, newest wins, and who may set the scanner.
#include "net/wire/image_pixels.h"
#include "tests/net/net_testing.h"
#include "tests/net/raw_peer.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::net::test {
namespace {

constexpr std::uint16_t kSide = 256;

ImageMessage image_of(ScannerArray array, std::uint64_t sequence) {
  ImageMessage image;
  image.array = array;
  image.width = image.height = kSide;
  image.sequence = sequence;
  image.spacing_mm = 0.25;
  image.data.resize(std::size_t{kSide} * kSide);
  for (std::size_t i = 0; i < image.data.size(); ++i)
    image.data[i] = static_cast<std::uint8_t>(i * i / 7 + sequence);
  return image;
}

ImageMessage packed(ImageMessage image) {
  const std::vector<std::uint8_t> pixels = std::move(image.data);
  image.data.clear();
  PixelPacker(pixels.size()).pack(pixels, image.data);
  image.flags |= kImageZlib;
  return image;
}

struct ImagesTest : ServerFixture {
  void start_scanner() {
    ServerOptions options;
    options.needles = 3;
    options.has_ultrasound = true;
    options.probe_needle = 2;
    start(options);
  }
  std::unique_ptr<Recorder> join_with(ClientOptions options) {
    auto client = join(std::move(options));
    EXPECT_TRUE(until([&] { return client->welcomes == 1; }));
    return client;
  }
  std::unique_ptr<Recorder> join_as_subscriber(bool takes_packed = false) {
    ClientOptions options;
    options.subscription = kSubscribeUltrasound;
    if (takes_packed) options.image_flags = kTakesZlib;
    return join_with(options);
  }
  void send_image(ScannerArray array, std::uint64_t sequence) {
    const ImageMessage image = image_of(array, sequence);
    server->publish_image(array, encoded_body(image), encoded_body(packed(image)));
  }
};

TEST_F(ImagesTest, GoToSubscribersAloneAndToThoseThatComeLaterTheNextOne) {
  start_scanner();
  const auto viewer = join_as(Role::kViewer, "older");
  const auto subscriber = join_as_subscriber();
  ASSERT_TRUE(until([&] { return viewer->welcomes == 1; }));
  EXPECT_EQ(subscriber->welcome.subscription, kSubscribeUltrasound);
  server->publish(sample_scanner());
  send_image(ScannerArray::kTransverse, 1);
  ASSERT_TRUE(until([&] { return subscriber->images.size() == 1; }));
  EXPECT_EQ(subscriber->images[0].data, image_of(ScannerArray::kTransverse, 1).data);
  ASSERT_EQ(subscriber->scanners.size(), 1u);
  EXPECT_EQ(subscriber->scanners[0].depth_mm, 60);

  const ImageDemand before = server->image_demand();
  const auto later = join_as_subscriber();
  ASSERT_TRUE(until([&] { return later->scanners.size() == 1; }));
  EXPECT_NE(server->image_demand(), before) << "the scanner sees that somebody waits for an image";
  send_image(ScannerArray::kSagittal, 2);
  ASSERT_TRUE(until([&] { return later->images.size() == 1 && subscriber->images.size() == 2; }));
  EXPECT_EQ(later->images[0].array, ScannerArray::kSagittal)
      << "the first is of an array that may be in use no longer";
  EXPECT_EQ(later->scanners.size(), 1u);
  ASSERT_TRUE(until([&] { return !viewer->states.empty(); }));
  EXPECT_TRUE(viewer->images.empty() && viewer->scanners.empty());
}

TEST_F(ImagesTest, ARecorderMayTakeTheSettingsAlone) {
  start_scanner();
  ClientOptions options;
  options.subscription = kSubscribeUltrasound;
  options.image_flags = kScannerOnly;
  const auto recorder = join_with(options);
  EXPECT_FALSE(server->image_demand().any) << "no image is made for it";
  server->publish(sample_scanner());
  const auto viewer = join_as_subscriber();
  send_image(ScannerArray::kTransverse, 1);
  ASSERT_TRUE(until([&] { return viewer->images.size() == 1 && recorder->scanners.size() == 1; }));
  recorder->client.request_state();
  ASSERT_TRUE(until([&] { return !recorder->states.empty(); }));
  EXPECT_TRUE(recorder->images.empty());
}

TEST_F(ImagesTest, AreNotGrantedByAServerWithoutUltrasound) {
  start();
  const auto subscriber = join_as_subscriber();
  EXPECT_EQ(subscriber->welcome.subscription, 0u);
  EXPECT_FALSE(server->image_demand().any);
}

TEST_F(ImagesTest, ComeCompressedToThoseThatTakeThatWithTheSamePixels) {
  start_scanner();
  const auto plain = join_as_subscriber(), compressed = join_as_subscriber(true);
  EXPECT_EQ(server->image_demand(), (ImageDemand{true, true, true, 2}));
  send_image(ScannerArray::kSagittal, 5);
  ASSERT_TRUE(until([&] { return plain->images.size() == 1 && compressed->images.size() == 1; }));
  EXPECT_EQ(plain->images[0].flags & kImageZlib, 0);
  EXPECT_EQ(compressed->images[0].flags & kImageZlib, kImageZlib);
  EXPECT_LT(compressed->images[0].data.size(), plain->images[0].data.size());
  std::vector<std::uint8_t> pixels;
  EXPECT_EQ(read_pixels(compressed->images[0], pixels), "");
  EXPECT_EQ(pixels, plain->images[0].data);
}

TEST_F(ImagesTest, OfEachArrayASlowClientGetsTheNewestAndDelaysNobody) {
  ServerOptions options;
  options.has_ultrasound = true;
  options.send_buffer_bytes = 4096;
  start(options);
  const auto good = join_as_subscriber();
  RawPeer slow(io, server->port(), 4096);
  slow.hello(Role::kViewer, kSubscribeUltrasound | kSubscribeNoMesh);
  ASSERT_TRUE(until([&] { return server->image_demand().joined == 2; }));
  constexpr std::uint64_t kImages = 20;
  for (std::uint64_t i = 1; i <= kImages; ++i)
    for (const ScannerArray array : {ScannerArray::kTransverse, ScannerArray::kSagittal}) {
      send_image(array, i);
      ASSERT_TRUE(until_at_once([&] {
        return !good->images.empty() && good->images.back().array == array &&
               good->images.back().sequence == i;
      }));
    }
  EXPECT_EQ(good->images.size(), 2 * kImages);
  const auto newest = [&](ScannerArray array) {
    std::uint64_t sequence = 0;
    for (const ImageMessage& image : slow.images)
      if (image.array == array) sequence = std::max(sequence, image.sequence);
    return sequence;
  };
  ASSERT_TRUE(until_at_once([&] {
    slow.take();
    return newest(ScannerArray::kTransverse) == kImages && newest(ScannerArray::kSagittal) == kImages;
  }));
  EXPECT_LT(slow.images.size(), kImages);
  EXPECT_EQ(slow.images.size() + server->images_dropped(), 2 * kImages);
}

TEST_F(ImagesTest, TheScannerIsSetByOperatorsAndTheProbesDeviceAlone) {
  start_scanner();
  const auto client_of = [&](Role role, std::uint16_t needle = kAnyNeedle) {
    ClientOptions options;
    options.role = role;
    options.needle = needle;
    return join_with(options);
  };
  ScannerMessage deeper;
  deeper.depth_mm = 70;
  for (const auto& client : {client_of(Role::kViewer), client_of(Role::kDevice, 0)}) {
    client->client.send(deeper);
    ASSERT_TRUE(until([&] { return !client->errors.empty(); }));
    EXPECT_EQ(client->errors[0].code, ErrorCode::kNotOperator);
  }
  EXPECT_TRUE(scanner_requests.empty());
  for (const auto& client : {client_of(Role::kOperator), client_of(Role::kDevice, 2)}) {
    scanner_requests.clear();
    client->client.send(deeper);
    ASSERT_TRUE(until([&] { return !scanner_requests.empty(); }));
    EXPECT_EQ(scanner_requests[0].depth_mm, 70);
    EXPECT_TRUE(std::isnan(scanner_requests[0].gain_db));
    EXPECT_TRUE(client->errors.empty());
  }
}

TEST_F(ImagesTest, ARefusedRequestIsAnsweredWithTheReason) {
  control_refusal = "depth_mm 700 is not between 10 and 150";
  start_scanner();
  ClientOptions options;
  options.role = Role::kOperator;
  const auto boss = join_with(options);
  boss->client.send(ScannerMessage{});
  ASSERT_TRUE(until([&] { return !boss->errors.empty(); }));
  EXPECT_EQ(boss->errors[0].code, ErrorCode::kScannerRefused);
  EXPECT_EQ(boss->errors[0].text, control_refusal);
  EXPECT_FALSE(boss->errors[0].fatal);
}

TEST_F(ImagesTest, AnImageFromAClientEndsItsConnection) {
  start_scanner();
  RawPeer peer(io, server->port());
  peer.hello();
  peer.send_message(sample_image());
  ASSERT_TRUE(until([&] {
    peer.take();
    return peer.fatal() == ErrorCode::kProtocol;
  }));
}

}  // namespace
}  // namespace brachy::net::test
