#include "net/igtl/codec/codec.h"

#include <array>
#include <utility>

#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/message_builder.h"
#include "net/wire/text.h"

namespace brachy::net::igtl {
namespace {

/// Column by column, the translation last.
void put_transform(Bytes& out, const RigidTransform& X) {
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) put(out, static_cast<float>(X.R(row, column)));
  for (int row = 0; row < 3; ++row) put(out, static_cast<float>(X.p(row)));
}

/// "live", "held" or "frozen", and " uncertified" where that flag is set.
std::string image_state(std::uint16_t flags) {
  std::string state = flags & kImageFrozen ? "frozen" : flags & kImageHeld ? "held" : "live";
  return flags & kImageUncertified ? state + " uncertified" : state;
}

}  // namespace

Bytes encode_empty(std::string_view type, const Label& label) {
  return MessageBuilder(type, label, 0).finish();
}

Bytes encode_transform(const Label& label, const RigidTransform& X, std::string_view status) {
  MessageBuilder message("TRANSFORM", label, kTransformBytes);
  put_transform(message.bytes(), X);
  if (status.empty()) return message.finish();
  const MessageBuilder::Metadata metadata[] = {{"TransformStatus", status}};
  return message.finish(metadata);
}

Bytes encode_status(const Label& label, const Status& status) {
  MessageBuilder message("STATUS", label, 31 + status.text.size());
  Bytes& out = message.bytes();
  put(out, static_cast<std::uint16_t>(status.code));
  put(out, static_cast<std::uint64_t>(status.sub_code));
  put_name(out, status.name, kNameBytes);
  put_name(out, status.text, status.text.size() + 1);  // ends with a zero
  return message.finish();
}

Bytes encode_tracking(const Label& label, std::span<const TrackedTool> tools) {
  constexpr auto kSixDegrees = std::byte{2};
  MessageBuilder message("TDATA", label, tools.size() * (kNameBytes + 2 + kTransformBytes));
  for (const TrackedTool& tool : tools) {
    put_name(message.bytes(), tool.name, kNameBytes);
    message.bytes().push_back(kSixDegrees);
    message.bytes().push_back(std::byte{0});
    put_transform(message.bytes(), tool.X);
  }
  return message.finish();
}

Bytes encode_start_answer(std::string_view type, const Label& label, bool is_done) {
  MessageBuilder message(type, label, 1);
  message.bytes().push_back(is_done ? std::byte{0} : std::byte{1});
  return message.finish();
}

Bytes encode_capability(const Label& label, std::span<const std::string_view> types) {
  MessageBuilder message("CAPABILITY", label, types.size() * kTypeBytes);
  for (const std::string_view type : types) put_name(message.bytes(), type, kTypeBytes);
  return message.finish();
}

Bytes encode_image(const Label& label, const ImageMessage& image, const RigidTransform& X_FI) {
  constexpr std::size_t kImageHeaderBytes = 72;
  constexpr std::uint16_t kVersion = 1;
  constexpr auto kComponents = std::byte{1}, kUint8 = std::byte{3}, kBigEndian = std::byte{1},
                 kRas = std::byte{1};
  MessageBuilder message("IMAGE", label, kImageHeaderBytes + image.data.size());
  Bytes& out = message.bytes();
  put(out, kVersion);
  out.insert(out.end(), {kComponents, kUint8, kBigEndian, kRas});
  const std::array<std::uint16_t, 3> size = {image.width, image.height, 1};
  for (const std::uint16_t side : size) put(out, side);
  RigidTransform matrix;
  matrix.R = image.spacing_mm * X_FI.R;
  matrix.p =
      X_FI * Vec3(0.5 * image.spacing_mm * (image.width - 1), 0.5 * image.spacing_mm * (image.height - 1), 0);
  put_transform(out, matrix);
  for (int offset = 0; offset < 3; ++offset) put(out, std::uint16_t{0});
  for (const std::uint16_t side : size) put(out, side);
  const auto pixels = std::as_bytes(std::span(image.data));
  out.insert(out.end(), pixels.begin(), pixels.end());
  const std::string state = image_state(image.flags);
  const MessageBuilder::Metadata metadata[] = {{"ImageState", state}};
  return message.finish(metadata);
}

Bytes encode_triangles(std::span<const Triangle> triangles) {
  Bytes out;
  out.reserve(triangles.size() * 16);
  for (const Triangle& triangle : triangles) {
    put(out, std::uint32_t{3});
    for (const std::uint32_t corner : triangle) put(out, corner);
  }
  return out;
}

Bytes encode_polydata(const Label& label, std::span<const float> points, std::span<const std::byte> triangles,
                      std::uint32_t triangle_count) {
  MessageBuilder message("POLYDATA", label, 40 + points.size_bytes() + triangles.size());
  Bytes& out = message.bytes();
  put(out, static_cast<std::uint32_t>(points.size() / 3));
  for (int vertices_and_lines = 0; vertices_and_lines < 4; ++vertices_and_lines) put(out, std::uint32_t{0});
  put(out, triangle_count);
  put(out, static_cast<std::uint32_t>(triangles.size()));
  for (int strips_and_attributes = 0; strips_and_attributes < 3; ++strips_and_attributes)
    put(out, std::uint32_t{0});
  for (const float coordinate : points) put(out, coordinate);
  out.insert(out.end(), triangles.begin(), triangles.end());
  return message.finish();
}

Header decode_header(std::span<const std::byte> bytes) {
  Header header;
  header.version = get<std::uint16_t>(bytes);
  header.type = to_wire_text(get_name(bytes.subspan(2, kTypeBytes)), kTypeBytes);
  header.device = to_wire_text(get_name(bytes.subspan(2 + kTypeBytes, kNameBytes)), kNameBytes);
  header.timestamp = get<std::uint64_t>(bytes.subspan(MessageBuilder::kSizeOffset - 8));
  header.body_size = get<std::uint64_t>(bytes.subspan(MessageBuilder::kSizeOffset));
  header.crc = get<std::uint64_t>(bytes.subspan(MessageBuilder::kCrcOffset));
  return header;
}

std::optional<RigidTransform> decode_transform(std::span<const std::byte> content) {
  if (content.size() != kTransformBytes) return std::nullopt;
  RigidTransform X;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row)
      X.R(row, column) = get_float(content.subspan(static_cast<std::size_t>(4 * (3 * column + row))));
  for (int row = 0; row < 3; ++row)
    X.p(row) = get_float(content.subspan(static_cast<std::size_t>(36 + 4 * row)));
  return X;
}

std::optional<StartTracking> decode_start_tracking(std::span<const std::byte> content) {
  constexpr std::size_t kBytes = 36;  // the resolution and the name of a coordinate system
  if (content.size() != kBytes) return std::nullopt;
  return StartTracking{get<std::uint32_t>(content)};
}

}  // namespace brachy::net::igtl
