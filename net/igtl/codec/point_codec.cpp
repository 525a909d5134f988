#include "net/igtl/codec/point_codec.h"

#include "net/igtl/codec/message_builder.h"

namespace brachy::net::igtl {

Bytes encode_points(const Label& label, std::span<const Point> points, std::string_view owner) {
  constexpr std::size_t kPointNameBytes = 64, kGroupBytes = 32;
  constexpr std::size_t kElementBytes = kPointNameBytes + kGroupBytes + 4 + 16 + kNameBytes;
  MessageBuilder message("POINT", label, kElementBytes * points.size());
  Bytes& out = message.bytes();
  for (const Point& point : points) {
    put_name(out, point.name, kPointNameBytes);
    put_name(out, point.group, kGroupBytes);
    for (const std::uint8_t channel : point.rgba) out.push_back(static_cast<std::byte>(channel));
    for (int i = 0; i < 3; ++i) put(out, static_cast<float>(point.position[i]));
    put(out, static_cast<float>(point.radius_mm));
    put_name(out, owner, kNameBytes);
  }
  return message.finish();
}

}  // namespace brachy::net::igtl
