#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "net/igtl/codec/messages.h"
#include "net/wire/byte_io.h"

namespace brachy::net::igtl {

/// One element of a POINT.
struct Point {
  std::string name;   ///< cut to 64 bytes
  std::string group;  ///< "Seeds", "Targets"; cut to 32 bytes
  std::array<std::uint8_t, 4> rgba{};
  Vec3 position = Vec3::Zero();  ///< mm, sent in single precision
  double radius_mm = 0;
};

/// A POINT message of all of them; `owner` is the image or model that they belong to, cut to kNameBytes.
Bytes encode_points(const Label& label, std::span<const Point> points, std::string_view owner);

}  // namespace brachy::net::igtl
