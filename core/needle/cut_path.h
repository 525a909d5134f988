#pragma once

#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The path a needle has cut, as material (rest) points from the entry on, with the arc length at each. Points lie
/// at least kResolution apart, so its memory is bounded by the capacity.
/// Threads: one. Real-time: no allocation after construction.
class CutPath {
 public:
  static constexpr double kResolution = 0.25;  ///< mm

  /// Reserves `length` mm of path; the path is not extended beyond it.
  explicit CutPath(double length);

  /// Clears the path and starts at `entry`.
  void start(const Vec3& entry) noexcept;

  /// Moves the end of the path to `point` (a straight cut from the present end).
  void extend_to(const Vec3& point) noexcept;

  /// Removes the path beyond arc length s.
  void cut_off(double s) noexcept;

  bool empty() const noexcept { return knots_.empty(); }  ///< no path has been started
  void clear() noexcept { knots_.clear(); }

  /// Arc length from the entry to the end, mm.
  double length() const noexcept { return end_length_; }

  /// The material point at arc length s, clamped to [0, length()].
  Vec3 at(double s) const noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(knots_, end_, end_length_);
  }

 private:
  struct Knot {
    Vec3 point;
    double s;
    template <class Archive>
    void list_state(Archive& archive) {
      archive(point, s);
    }
  };
  std::vector<Knot> knots_;
  std::size_t capacity_;
  Vec3 end_ = Vec3::Zero();
  double end_length_ = 0;
};

}  // namespace brachy
