#include "core/ultrasound/image_plane.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr double kRadian = std::numbers::pi / 180;

Mat3 axes(const Vec3& a, const Vec3& b) {
  Mat3 R;
  R.col(0) = a;
  R.col(1) = b;
  R.col(2) = a.cross(b);
  return R;
}

}  // namespace

ImagePlane::ImagePlane(const UltrasoundSettings& settings, double probe_radius_mm)
    : lines_(static_cast<std::size_t>(settings.lines)),
      width_(static_cast<std::size_t>(settings.width_px)),
      height_(static_cast<std::size_t>(settings.height_px)),
      depth_(settings.depth_mm),
      radius_(probe_radius_mm) {
  const auto count = static_cast<double>(lines_);
  X_PI_.p.z() = -settings.array_from_tip_mm;
  if (settings.array == "transverse") {
    X_PI_.R = axes(-Vec3::UnitX(), Vec3::UnitY());
  } else if (settings.array == "sagittal") {
    X_PI_.R = axes(-Vec3::UnitZ(), Vec3::UnitY());
    is_fan_ = false;
  } else if (settings.array == "end_fire") {
    X_PI_.R = axes(-Vec3::UnitX(), Vec3::UnitZ());
    X_PI_.p.z() = -radius_;
  } else {
    throw UserError("ultrasound.array: \"" + settings.array +
                    "\" is none; give transverse, sagittal or end_fire");
  }
  if (is_fan_) {
    step_ = settings.fov_deg * kRadian / count;
    first_ = -0.5 * step_ * (count - 1);
    const double half = 0.5 * settings.fov_deg * kRadian, outer = radius_ + depth_;
    least_a_ = half >= 0.5 * std::numbers::pi ? -outer : -outer * std::sin(half);
    least_b_ = std::cos(half) * (half > 0.5 * std::numbers::pi ? outer : radius_);
  } else {
    step_ = settings.length_mm / count;
    first_ = -0.5 * step_ * (count - 1);
    least_a_ = -0.5 * settings.length_mm;
    least_b_ = radius_;
  }
  most_b_ = radius_ + depth_;
  const auto width = static_cast<double>(width_), height = static_cast<double>(height_);
  spacing_ = std::max(-2 * least_a_ / width, (most_b_ - least_b_) / height);
  left_ = -0.5 * spacing_ * (width - 1);
  const double margin = 0.5 * (height * spacing_ - (most_b_ - least_b_));
  top_ = most_b_ + margin - 0.5 * spacing_;
}

double ImagePlane::line_spacing_mm(double depth) const {
  return is_fan_ ? step_ * (radius_ + depth) : step_;
}

PlanePoint ImagePlane::beam(double line) const {
  if (!is_fan_) return {0, 1};
  const double angle = first_ + step_ * line;
  return {std::sin(angle), std::cos(angle)};
}

PlanePoint ImagePlane::at(double line, double depth) const {
  if (!is_fan_) return {first_ + step_ * line, radius_ + depth};
  const PlanePoint d = beam(line);
  return {(radius_ + depth) * d.a, (radius_ + depth) * d.b};
}

LinePoint ImagePlane::find(const PlanePoint& p) const {
  if (!is_fan_) return {(p.a - first_) / step_, p.b - radius_};
  return {(std::atan2(p.a, p.b) - first_) / step_, std::hypot(p.a, p.b) - radius_};
}

PlanePoint ImagePlane::pixel(double column, double row) const {
  return {left_ + column * spacing_, top_ - row * spacing_};
}

RigidTransform ImagePlane::image_in_plane() const {
  return {axes(Vec3::UnitX(), -Vec3::UnitY()), Vec3(left_, top_, 0)};
}

RigidTransform resting_probe(const UltrasoundSettings& settings, double probe_radius_mm,
                             double rectal_wall_mm, const Vec3& least, const Vec3& most) {
  const Vec3 middle = 0.5 * (least + most);
  const double angle = settings.rotation_deg * kRadian;
  RigidTransform X_WP;
  X_WP.R << std::cos(angle), -std::sin(angle), 0, std::sin(angle), std::cos(angle), 0, 0, 0, 1;
  X_WP.p = Vec3(middle.x(), least.y() - rectal_wall_mm - probe_radius_mm,
                middle.z() + settings.offset_mm + settings.array_from_tip_mm);
  return X_WP;
}

}  // namespace brachy
