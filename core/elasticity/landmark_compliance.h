#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/elasticity/beam.h"

namespace brachy {

/// What gives way at landmarks besides the tissue: needles that bend. With K the tissue's compliance and C this one,
/// forces f on the tissue displace it by K f and the needles by −C f, so that landmarks that would be displaced by d if
/// all but the tissue were rigid have (K + C) f = d. C is positive semidefinite, so K + C is as definite as K.
/// Threads: a plain value. Real-time: no allocation within what was reserved.
class LandmarkCompliance {
 public:
  /// Where a landmark is on a beam.
  struct Point {
    std::int32_t beam = -1;  ///< −1: on none
    double arc_mm = 0;       ///< from the hub

    bool operator==(const Point&) const = default;
  };

  void reserve(std::size_t landmarks, std::size_t beams);
  void clear() noexcept;
  /// The next landmarks' beam; returns its number.
  std::int32_t add_beam(const Beam& beam) noexcept;
  void add_landmark(const Point& point) noexcept { points_.push_back(point); }
  /// Removes landmark i.
  void remove_landmark(std::size_t i) noexcept;

  bool is_empty() const { return beams_.empty(); }  ///< nothing gives
  /// K += scale C, in the lower triangle of the 3n × 3n matrix.
  void add_to(Eigen::Ref<Eigen::MatrixXd> K, double scale) const noexcept;
  /// displacements −= C forces (both n, mm, N).
  void subtract(std::span<const Vec3> forces, std::span<Vec3> displacements) const noexcept;

  bool operator==(const LandmarkCompliance&) const = default;

 private:
  std::vector<Beam> beams_;
  std::vector<Point> points_;  // of every landmark
};

}  // namespace brachy
