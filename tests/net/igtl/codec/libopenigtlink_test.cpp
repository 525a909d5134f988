// Debian's libopenigtlink as an oracle: its encoding and ours are equal byte for byte, and each decodes the other's. It
// supports version 1 of the header only. Upstream's (scripts/campaigns/openigtlink.sh) writes that where not asked.
#include <gtest/gtest.h>
#include <igtl_util.h>
#include <igtlCapabilityMessage.h>
#include <igtlImageMessage.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>
#if OpenIGTLink_PROTOCOL_VERSION >= 3
#include <igtlCommandMessage.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <random>

#include "net/igtl/codec/codec.h"
#include "net/igtl/codec/crc64.h"
#include "net/igtl/codec/message_parser.h"
#include "net/igtl/codec/point_codec.h"
#include "net/igtl/codec/text_codec.h"
#include "tests/net/igtl/igtl_peer.h"

namespace brachy::net::igtl {
namespace {

using test::with_right_size_and_crc;

constexpr std::uint64_t kTimestamp = 0x65510000'80000000;

template <class Message>
typename Message::Pointer labelled(const char* device) {
  auto message = Message::New();
  message->SetDeviceName(device);
  message->SetTimeStamp(kTimestamp >> 32, kTimestamp & 0xFFFFFFFF);
  return message;
}

template <class Pointer>
Bytes packed(const Pointer& message) {
  message->Pack();
  Bytes bytes(static_cast<std::size_t>(message->GetPackSize()));
  std::memcpy(bytes.data(), message->GetPackPointer(), bytes.size());
  return bytes;
}

/// Our bytes decoded by libopenigtlink; the CRC is checked.
template <class Message>
typename Message::Pointer unpacked(const Bytes& bytes) {
  auto header = ::igtl::MessageHeader::New();
  header->InitPack();
  std::memcpy(header->GetPackPointer(), bytes.data(), kHeaderSize);
  header->Unpack();
  auto message = Message::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  EXPECT_EQ(static_cast<std::size_t>(message->GetPackBodySize()), bytes.size() - kHeaderSize);
  std::memcpy(message->GetPackBodyPointer(), bytes.data() + kHeaderSize, bytes.size() - kHeaderSize);
  EXPECT_TRUE(message->Unpack(1) & ::igtl::MessageHeader::UNPACK_BODY) << "wrong CRC or body";
  return message;
}

::testing::AssertionResult same(const Bytes& theirs, const Bytes& ours) {
  if (theirs == ours) return ::testing::AssertionSuccess();
  const auto at =
      std::mismatch(theirs.begin(), theirs.end(), ours.begin(), ours.end()).first - theirs.begin();
  return ::testing::AssertionFailure() << "theirs has " << theirs.size() << " bytes, ours " << ours.size()
                                       << ", the first that differs at " << at;
}

Label label(const char* device) {
  return {1, device, kTimestamp};
}

/// In single precision, as OpenIGTLink has it.
RigidTransform random_pose(std::mt19937& random) {
  std::uniform_real_distribution<float> number(-100, 100);
  RigidTransform X;
  for (int i = 0; i < 9; ++i) X.R(i / 3, i % 3) = number(random);
  for (int i = 0; i < 3; ++i) X.p(i) = number(random);
  return X;
}

void fill(::igtl::Matrix4x4& matrix, const RigidTransform& X) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) matrix[row][column] = static_cast<float>(X.R(row, column));
    matrix[row][3] = static_cast<float>(X.p(row));
    matrix[3][row] = 0;
  }
  matrix[3][3] = 1;
}

void expect_same(const ::igtl::Matrix4x4& matrix, const RigidTransform& X) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) EXPECT_EQ(matrix[row][column], X.R(row, column));
    EXPECT_EQ(matrix[row][3], X.p(row));
  }
}

/// Theirs, parsed by us.
MessageParser::Message parsed(const Bytes& bytes, MessageParser& parser) {
  MessageParser::Message message;
  parser.feed(bytes);
  EXPECT_EQ(parser.next(message), Parsed::kMessage);
  return message;
}

TEST(LibOpenIgtLink, HasTheSameCrc) {
  std::mt19937 random(1);
  for (std::size_t size = 0; size < 200; ++size) {
    Bytes bytes(size);
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
    std::vector<unsigned char> copy(size + 1);
    if (size > 0) std::memcpy(copy.data(), bytes.data(), size);
    EXPECT_EQ(crc64(bytes), ::crc64(copy.data(), size, 0));
  }
}

TEST(LibOpenIgtLink, TransformsAreTheSameBytesBothWays) {
  std::mt19937 random(2);
  for (const char* device : {"NeedleToRas", "", "Needle15ToRas", "twenty bytes exactly"}) {
    const RigidTransform X = random_pose(random);
    ::igtl::Matrix4x4 matrix;
    fill(matrix, X);
    auto message = labelled<::igtl::TransformMessage>(device);
    message->SetMatrix(matrix);
    const Bytes theirs = packed(message), ours = encode_transform(label(device), X);
    EXPECT_TRUE(same(theirs, ours));
    ::igtl::Matrix4x4 back;
    unpacked<::igtl::TransformMessage>(ours)->GetMatrix(back);
    expect_same(back, X);
    MessageParser parser;
    const auto read = parsed(theirs, parser);
    EXPECT_EQ(read.header.device, device);
    EXPECT_EQ(read.header.timestamp, kTimestamp);
    const auto again = decode_transform(read.content);
    ASSERT_TRUE(again);
    EXPECT_TRUE(*again == X);
  }
}

TEST(LibOpenIgtLink, QueriesAreTheSameBytesBothWays) {
  const auto check = [](const auto& message, const char* type) {
    const Bytes theirs = packed(message);
    EXPECT_TRUE(same(theirs, encode_empty(type, label("Client")))) << type;
    MessageParser parser;
    EXPECT_EQ(parsed(theirs, parser).header.type, type);
  };
  check(labelled<::igtl::GetTransformMessage>("Client"), "GET_TRANS");
  check(labelled<::igtl::GetStatusMessage>("Client"), "GET_STATUS");
  check(labelled<::igtl::GetPolyDataMessage>("Client"), "GET_POLYDATA");
#if OpenIGTLink_PROTOCOL_VERSION < 3  // upstream has none
  check(labelled<::igtl::GetCapabilityMessage>("Client"), "GET_CAPABIL");
#endif
  check(labelled<::igtl::StopTrackingDataMessage>("Client"), "STP_TDATA");
}

TEST(LibOpenIgtLink, StatusesAreTheSameBytesBothWays) {
  for (const char* text : {"", "needle 0 is held by touch (127.0.0.1:4711): disconnect that device first"}) {
    auto message = labelled<::igtl::StatusMessage>("prostate");
    message->SetCode(6);
    message->SetSubCode(-3);
    message->SetErrorName("PoseRefused");
    message->SetStatusString(text);
    const Bytes ours = encode_status(label("prostate"), {StatusCode::kBusy, -3, "PoseRefused", text});
    EXPECT_TRUE(same(packed(message), ours));
    const auto back = unpacked<::igtl::StatusMessage>(ours);
    EXPECT_EQ(back->GetCode(), 6);
    EXPECT_EQ(back->GetSubCode(), -3);
    EXPECT_STREQ(back->GetErrorName(), "PoseRefused");
    EXPECT_STREQ(back->GetStatusString(), text);
  }
}

TEST(LibOpenIgtLink, TrackingDataIsTheSameBytesBothWays) {
  std::mt19937 random(3);
  for (int count : {0, 1, 3}) {
    auto message = labelled<::igtl::TrackingDataMessage>("Needles");
    std::vector<TrackedTool> tools;
    for (int i = 0; i < count; ++i) {
      tools.push_back({"Needle" + std::to_string(i) + "ToRas", random_pose(random)});
      ::igtl::Matrix4x4 matrix;
      fill(matrix, tools.back().X);
      auto element = ::igtl::TrackingDataElement::New();
      element->SetName(tools.back().name.c_str());
      element->SetType(::igtl::TrackingDataElement::TYPE_6D);
      element->SetMatrix(matrix);
      message->AddTrackingDataElement(element);
    }
    const Bytes ours = encode_tracking(label("Needles"), tools);
    Bytes theirs = packed(message);
    // libopenigtlink 1.11 leaves the reserved byte behind a tool's type as it finds it.
    for (std::size_t at = kHeaderSize + kNameBytes + 1; at < theirs.size(); at += 70)
      theirs[at] = std::byte{0};
    EXPECT_TRUE(same(with_right_size_and_crc(theirs), ours));
    if (count == 0) continue;  // nothing to unpack
    const auto back = unpacked<::igtl::TrackingDataMessage>(ours);
    ASSERT_EQ(back->GetNumberOfTrackingDataElements(), count);
    for (int i = 0; i < count; ++i) {
      ::igtl::TrackingDataElement::Pointer element;
      back->GetTrackingDataElement(i, element);
      EXPECT_EQ(element->GetName(), tools[static_cast<std::size_t>(i)].name);
      ::igtl::Matrix4x4 matrix;
      element->GetMatrix(matrix);
      expect_same(matrix, tools[static_cast<std::size_t>(i)].X);
    }
  }
}

TEST(LibOpenIgtLink, TrackingIsStartedByItsMessageAndAnsweredByOurs) {
  auto start = labelled<::igtl::StartTrackingDataMessage>("TDataClient");
  start->SetResolution(50);
  start->SetCoordinateName("Patient");
  MessageParser parser;
  const auto read = parsed(packed(start), parser);
  EXPECT_EQ(read.header.type, "STT_TDATA");
  const auto asked = decode_start_tracking(read.content);
  ASSERT_TRUE(asked);
  EXPECT_EQ(asked->resolution_ms, 50u);

  auto answer = labelled<::igtl::RTSTrackingDataMessage>("TDataClient");
  answer->SetStatus(::igtl::RTSTrackingDataMessage::STATUS_SUCCESS);
  const Bytes ours = encode_start_answer("RTS_TDATA", label("TDataClient"));
  EXPECT_TRUE(same(packed(answer), ours));
  EXPECT_EQ(unpacked<::igtl::RTSTrackingDataMessage>(ours)->GetStatus(), 0);
}

TEST(LibOpenIgtLink, PointsAreTheSameBytesBothWays) {
  auto theirs = labelled<::igtl::PointMessage>("Seeds");
  std::vector<Point> points;
  for (int i = 1; i <= 3; ++i) {
    const auto x = static_cast<float>(i);
    auto element = ::igtl::PointElement::New();
    element->SetName(("Seed " + std::to_string(i)).c_str());
    element->SetGroupName("Seeds");
    element->SetRGBA(1, 2, 3, 255);
    element->SetPosition(x, -2 * x, 0.5F * x);
    element->SetRadius(0.5F);
    element->SetOwner("gland");
    theirs->AddPointElement(element);
    points.push_back({"Seed " + std::to_string(i), "Seeds", {1, 2, 3, 255}, Vec3(x, -2 * x, 0.5 * x), 0.5});
  }
  const Bytes ours = encode_points(label("Seeds"), points, "gland");
  EXPECT_TRUE(same(packed(theirs), ours));
  const auto read = unpacked<::igtl::PointMessage>(ours);
  ASSERT_EQ(read->GetNumberOfPointElement(), 3);
  ::igtl::PointElement::Pointer last;
  read->GetPointElement(2, last);
  EXPECT_STREQ(last->GetName(), "Seed 3");
}

TEST(LibOpenIgtLink, ItsStringsAreRead) {
  auto theirs = labelled<::igtl::StringMessage>("Slicer");
  theirs->SetString("drop 0");
  const Bytes bytes = packed(theirs);
  EXPECT_EQ(decode_string(std::span(bytes).subspan(kHeaderSize)), "drop 0");
}

TEST(LibOpenIgtLink, CapabilityIsTheSameBytesBothWays) {
  const std::array<std::string_view, 2> types = {"TRANSFORM", "GET_POLYDATA"};
  auto message = labelled<::igtl::CapabilityMessage>("Device");
  message->SetTypes({"TRANSFORM", "GET_POLYDATA"});
  const Bytes ours = encode_capability(label("Device"), types);
  EXPECT_TRUE(same(packed(message), ours));
  const auto back = unpacked<::igtl::CapabilityMessage>(ours);
  ASSERT_EQ(back->GetNumberOfTypes(), 2);
  EXPECT_STREQ(back->GetType(0), "TRANSFORM");
  EXPECT_STREQ(back->GetType(1), "GET_POLYDATA");
}

/// An oblique image, as a probe turned and tilted has it.
ImageMessage oblique_image() {
  ImageMessage image;
  image.width = 7;
  image.height = 5;
  image.spacing_mm = 0.25;
  image.X_WI.R = (Eigen::AngleAxisd(0.4, Vec3(1, 2, -0.5).normalized()) * Eigen::AngleAxisd(2, Vec3::UnitY()))
                     .toRotationMatrix();
  image.X_WI.p = Vec3(12.5, -31, 7.75);
  for (int i = 0; i < 35; ++i) image.data.push_back(static_cast<std::uint8_t>(7 * i));
  return image;
}

TEST(LibOpenIgtLink, ImagesAreTheSameBytesBothWays) {
  const ImageMessage image = oblique_image();
  auto theirs = labelled<::igtl::ImageMessage>("UltrasoundTransverse");
  theirs->SetDimensions(image.width, image.height, 1);
  theirs->SetSpacing(0.25F, 0.25F, 0.25F);
  theirs->SetNumComponents(1);
  theirs->SetScalarType(::igtl::ImageMessage::TYPE_UINT8);
  theirs->SetEndian(::igtl::ImageMessage::ENDIAN_BIG);
  theirs->SetCoordinateSystem(::igtl::ImageMessage::COORDINATE_RAS);
  theirs->AllocateScalars();
  std::memcpy(theirs->GetScalarPointer(), image.data.data(), image.data.size());
  RigidTransform middle = image.X_WI;
  middle.p = image.X_WI * Vec3(0.25 * 3, 0.25 * 2, 0);
  ::igtl::Matrix4x4 matrix;
  fill(matrix, middle);
  theirs->SetMatrix(matrix);
  const Bytes ours = encode_image(label("UltrasoundTransverse"), image, image.X_WI);
  EXPECT_TRUE(same(packed(theirs), ours));
}

/// Where SlicerOpenIGTLink and PLUS put pixel (i, j): the message's place is that of the volume's middle, which one
/// reader takes as (size − 1)/2 pixels from the first pixel's middle, another as size/2.
Vec3 placed(const ::igtl::Matrix4x4& matrix, const float spacing[3], const int size[3], double from_size,
            int i, int j) {
  Vec3 place(matrix[0][3], matrix[1][3], matrix[2][3]);
  const double at[3] = {i - 0.5 * (size[0] - from_size), j - 0.5 * (size[1] - from_size),
                        -0.5 * (size[2] - from_size)};
  for (int axis = 0; axis < 3; ++axis)
    place += at[axis] * static_cast<double>(spacing[axis]) *
             Vec3(matrix[0][axis], matrix[1][axis], matrix[2][axis]);
  return place;
}

TEST(LibOpenIgtLink, AnObliqueImagesPixelsLieWhereTheyAreToHalfAPixel) {
  const ImageMessage image = oblique_image();
  const auto back =
      unpacked<::igtl::ImageMessage>(encode_image(label("UltrasoundSagittal"), image, image.X_WI));
  int size[3], offset[3];
  back->GetDimensions(size);
  ASSERT_EQ(size[0], 7);
  ASSERT_EQ(size[1], 5);
  ASSERT_EQ(size[2], 1);
  int part[3];
  back->GetSubVolume(part, offset);
  EXPECT_EQ(offset[0] + offset[1] + offset[2], 0);
  EXPECT_EQ(part[0], 7);
  EXPECT_EQ(back->GetScalarType(), ::igtl::ImageMessage::TYPE_UINT8);
  EXPECT_EQ(back->GetCoordinateSystem(), ::igtl::ImageMessage::COORDINATE_RAS);
  ASSERT_EQ(back->GetImageSize(), 35);
  EXPECT_EQ(std::memcmp(back->GetScalarPointer(), image.data.data(), 35), 0);
  float spacing[3];
  back->GetSpacing(spacing);
  for (const float s : spacing) EXPECT_NEAR(s, 0.25F, 1e-6F);
  ::igtl::Matrix4x4 matrix;
  back->GetMatrix(matrix);
  for (int i = 0; i < 7; ++i)
    for (int j = 0; j < 5; ++j) {
      const Vec3 truth = image.X_WI * Vec3(0.25 * i, 0.25 * j, 0);
      EXPECT_LE((placed(matrix, spacing, size, 1, i, j) - truth).norm(), 1e-4);
      // By the other reading off by half a pixel in each direction.
      const Vec3 off = image.X_WI.R.transpose() * (placed(matrix, spacing, size, 0, i, j) - truth);
      EXPECT_LE(off.cwiseAbs().maxCoeff(), 0.5 * 0.25 + 1e-4);
    }
}

TEST(LibOpenIgtLink, ImagesAreAskedForByItsMessagesAndAnsweredByOurs) {
  const auto check = [](const auto& message, const char* type) {
    MessageParser parser;
    EXPECT_EQ(parsed(packed(message), parser).header.type, type);
  };
  check(labelled<::igtl::GetImageMessage>("Ultrasound"), "GET_IMAGE");
}

TEST(LibOpenIgtLink, PolydataIsTheSameBytesBothWays) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> coordinate(-50, 50);
  std::vector<float> points(3 * 100);
  for (float& c : points) c = coordinate(random);
  std::vector<Triangle> triangles(196);
  for (Triangle& triangle : triangles)
    for (std::uint32_t& corner : triangle) corner = static_cast<std::uint32_t>(random() % 100);

  auto theirs = labelled<::igtl::PolyDataMessage>("prostate");
  auto array = ::igtl::PolyDataPointArray::New();
  for (std::size_t i = 0; i < points.size(); i += 3) array->AddPoint(points[i], points[i + 1], points[i + 2]);
  auto polygons = ::igtl::PolyDataCellArray::New();
  for (Triangle& triangle : triangles) polygons->AddCell(3, triangle.data());
  theirs->SetPoints(array);
  theirs->SetPolygons(polygons);
  const Bytes ours = encode_polydata(label("prostate"), points, encode_triangles(triangles),
                                     static_cast<std::uint32_t>(triangles.size()));
  EXPECT_TRUE(same(packed(theirs), ours));

  const auto back = unpacked<::igtl::PolyDataMessage>(ours);
  ASSERT_EQ(back->GetPoints()->GetNumberOfPoints(), 100);
  for (unsigned i = 0; i < 100; ++i) {
    igtlFloat32 point[3];
    back->GetPoints()->GetPoint(i, point);
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(point[axis], points[3 * i + axis]);
  }
  ASSERT_EQ(back->GetPolygons()->GetNumberOfCells(), triangles.size());
  for (unsigned i = 0; i < triangles.size(); ++i) {
    std::array<igtlUint32, 3> cell{};
    back->GetPolygons()->GetCell(i, cell.data());
    EXPECT_EQ(cell, triangles[i]);
  }
}

#if OpenIGTLink_PROTOCOL_VERSION >= 3

TEST(LibOpenIgtLink, TransformsOfVersion2AreReadBothWaysWithTheirStatus) {
  std::mt19937 random(7);
  const RigidTransform X = random_pose(random);
  ::igtl::Matrix4x4 matrix, back;
  fill(matrix, X);
  auto message = labelled<::igtl::TransformMessage>("NeedleToRas");
  message->SetHeaderVersion(IGTL_HEADER_VERSION_2);
  message->SetMatrix(matrix);
  message->SetMetaDataElement("TransformStatus", IANA_TYPE_US_ASCII, "INVALID");
  MessageParser parser;
  const auto read = parsed(packed(message), parser);
  EXPECT_EQ(read.header.version, 2);
  EXPECT_EQ(read.find_metadata("TransformStatus"), "INVALID");
  const auto again = decode_transform(read.content);
  ASSERT_TRUE(again);
  EXPECT_TRUE(*again == X);

  const auto ours = unpacked<::igtl::TransformMessage>(encode_transform({2, "NeedleToRas", kTimestamp}, X));
  ours->GetMatrix(back);
  expect_same(back, X);
}

TEST(LibOpenIgtLink, CommandsAreReadAndTheirAnswersUnpacked) {
  auto command = labelled<::igtl::CommandMessage>("Client");
  command->SetHeaderVersion(IGTL_HEADER_VERSION_2);
  command->SetCommandId(42);
  command->SetCommandName("reset");
  command->SetCommandContent("<Command/>");
  MessageParser parser;
  const auto read = decode_command(parsed(packed(command), parser).content);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->id, 42u);
  EXPECT_EQ(read->name, "reset");
  EXPECT_EQ(read->content, "<Command/>");

  const auto answer = unpacked<::igtl::RTSCommandMessage>(
      encode_command_answer({2, "Client", kTimestamp}, 42, 13, "no such thing"));
  EXPECT_EQ(answer->GetCommandId(), 42u);
  EXPECT_EQ(answer->GetCommandErrorString(), "no such thing");
}

#endif

}  // namespace
}  // namespace brachy::net::igtl
