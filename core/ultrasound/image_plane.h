#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "core/base/rigid_transform.h"
#include "core/ultrasound/ultrasound_settings.h"

namespace brachy {

/// A position in the image plane, mm: `a` across (to the right of the screen), `b` away from the probe (up).
struct PlanePoint {
  double a = 0, b = 0;
};

/// The same on scan lines: both continuous.
struct LinePoint {
  double line = 0;   ///< 0 … lines − 1
  double depth = 0;  ///< mm from the probe's surface
};

/// Where an array's scan lines and pixels are: geometry only, constant.
///
/// Plane frame I: origin on the probe's axis in the middle of the array, +x = a, +y = b, +z = n across the plane. In
/// the probe's frame P (tip at the origin, +z to the tip; unturned, +y is the patient's front, +x his right):
///   transverse  a = −x (patient's right on the left), b = y, n = −z; lines fan out from the probe's surface
///   sagittal    a = −z (base on the left),           b = y, n = x;  lines parallel, from the probe's surface
///   end_fire    a = −x,                              b = z, n = y;  a fan from the probe's round tip
/// Pixels are square; row 0 is the farthest from the probe, which is at the bottom, as in brachytherapy.
/// Threads: any.
class ImagePlane {
 public:
  /// `probe_radius_mm`: of its cylinder. Errors: UserError for an unknown array.
  ImagePlane(const UltrasoundSettings& settings, double probe_radius_mm);

  std::size_t lines() const { return lines_; }
  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }
  double spacing_mm() const { return spacing_; }  ///< of pixels
  double depth_mm() const { return depth_; }
  bool is_fan() const { return is_fan_; }
  double radius_mm() const {
    return radius_;
  }  ///< of the array; of a sagittal one how far it is from the axis
  double line_spacing_mm(double depth) const;

  PlanePoint at(double line, double depth) const;
  LinePoint find(const PlanePoint& p) const;
  PlanePoint beam(double line) const;  ///< unit
  PlanePoint pixel(double column, double row) const;
  double column_of(double a) const { return (a - left_) / spacing_; }
  double row_of(double b) const { return (top_ - b) / spacing_; }
  bool is_in_scan(const LinePoint& p) const {
    return p.depth >= 0 && p.depth <= depth_ && p.line >= 0 && p.line <= static_cast<double>(lines_ - 1);
  }
  // Box about the scan, mm.
  double left_mm() const { return least_a_; }
  double right_mm() const { return -least_a_; }
  double bottom_mm() const { return least_b_; }
  double top_mm() const { return most_b_; }

  /// X_PI, of the plane in the probe's frame.
  const RigidTransform& in_probe() const { return X_PI_; }
  /// From pixel coordinates (mm: column × spacing along +x, row × spacing along +y; first pixel's centre 0) to
  /// the frame I, for OpenIGTLink and NRRD: +z then points to −n.
  RigidTransform image_in_plane() const;

 private:
  bool is_fan_ = true;
  std::size_t lines_, width_, height_;
  double depth_, radius_, first_ = 0, step_ = 0;  // rad of a fan, mm of a linear array
  double spacing_ = 1, left_ = 0, top_ = 0;
  double least_a_ = 0, least_b_ = 0, most_b_ = 0;
  RigidTransform X_PI_;
};

/// Where a probe without a pose of its own is: X_WP, behind a gland in the box `least` … `most` (mm, W).
RigidTransform resting_probe(const UltrasoundSettings& settings, double probe_radius_mm,
                             double rectal_wall_mm, const Vec3& least, const Vec3& most);

}  // namespace brachy
