// FRAME's section NEEDLE_SHAPES.
#include <algorithm>

#include "net/wire/shape_fields.h"

namespace brachy::net {
namespace {

constexpr std::size_t kShapeBytes = 8 + 2 * 24;  // one entry without its points
constexpr std::size_t kShapePointBytes = 12;

std::vector<float> coordinates_of(const NeedleShape& shape) {
  std::vector<float> coordinates;
  coordinates.reserve(3 * shape.points.size());
  for (const Vec3& p : shape.points)
    for (int axis = 0; axis < 3; ++axis) coordinates.push_back(static_cast<float>(p[axis]));
  return coordinates;
}

/// Both are at equal arc lengths. The same number of points stays bit for bit.
void set_points(NeedleShape& shape, const std::vector<float>& coordinates) {
  const std::size_t last = coordinates.size() / 3 - 1;
  const auto point = [&](std::size_t i) {
    return Vec3(coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2]);
  };
  for (std::size_t k = 0; k < NeedleShape::kPoints; ++k) {
    const std::size_t i = k * last / (NeedleShape::kPoints - 1);
    const std::size_t rest = k * last % (NeedleShape::kPoints - 1);
    const double share = static_cast<double>(rest) / (NeedleShape::kPoints - 1);
    shape.points[k] = rest == 0 ? point(i) : Vec3((1 - share) * point(i) + share * point(i + 1));
  }
}

}  // namespace

void shapes_section(FieldWriter& archive, const FrameMessage& message) {
  archive.u16(std::ranges::count_if(message.needles, has_shape));
  archive.reserved(2);
  for (const NeedleRecord& needle : message.needles) {
    if (!has_shape(needle)) continue;
    const NeedleShape& shape = needle.state.shape;
    archive.u16(needle.id);
    archive.u16(NeedleShape::kPoints);
    archive.reserved(4);
    archive.vec3(shape.tip_axis);
    archive.vec3(shape.tip_deflection);
    archive.floats(coordinates_of(shape), 3 * NeedleShape::kPoints);
  }
}

void shapes_section(FieldReader& archive, FrameMessage& message) {
  std::uint16_t count = 0;
  archive.u16(count);
  archive.reserved(2);
  archive.fits(count, kShapeBytes + 2 * kShapePointBytes);
  std::vector<float> coordinates;
  for (std::uint16_t i = 0; i < count && archive.ok(); ++i) {
    std::uint16_t id = 0, points = 0;
    archive.u16(id);
    archive.u16(points);
    archive.reserved(4);
    const auto needle = std::ranges::find(message.needles, id, &NeedleRecord::id);
    archive.check(needle != message.needles.end() && needle->state.present,
                  "a shape names a needle that is not there");
    archive.check(points >= 2, "a needle's shape has fewer than two points");
    if (!archive.ok()) return;
    NeedleShape shape;
    shape.is_bent = true;
    archive.vec3(shape.tip_axis);
    archive.vec3(shape.tip_deflection);
    archive.floats(coordinates, 3 * std::uint64_t{points});
    if (!archive.ok()) return;
    set_points(shape, coordinates);
    archive.check(shape.is_finite(), "a needle's shape is not finite");
    needle->state.shape = shape;
  }
}

}  // namespace brachy::net
