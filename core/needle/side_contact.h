#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"

namespace brachy {

/// A needle that lies against the tissue from the side, with its shaft or with the end that has the tip.
///
/// The needle's leading edge, its line moved by a radius towards the tissue, lies inside the surface at rest along a
/// chord. Points of the surface beside that chord are pushed out of its way as far as it lies under them, in one
/// direction across the needle; they slide, and are not pulled. The direction is against the surface's normals at
/// these points and follows them over kTurnMm of motion. Where the edge is nearer to the far side it pushes no
/// farther than that, so that a needle that is drawn through sidewise lets go without a jump. Where the surface slants
/// by more than 30° against the direction, it is pushed by less: the tissue makes way along its normal.
/// Models that know no forces have one point for the whole contact, of which alone their scale is known.
/// Limits: one direction for the whole contact; no friction; the needle's line is taken as straight.
/// Threads: one. Real-time: no allocation after construction, no exceptions; two BVH queries a point.
class SideContact {
 public:
  /// mm of the needle's length for each point, and most points; of a longer chord they lie farther apart
  static constexpr double kSpacingMm = 3;
  static constexpr std::size_t kMaxPoints = 12;
  static constexpr double kTurnMm = 0.5;  ///< of motion over which the direction follows the surface
  /// Core of a point's force as the line of them is as stiff as a strip as wide as the needle, in radii.
  static constexpr double kLineCore = 0.8;

  struct Point {
    Vec3 rest = Vec3::Zero();  ///< on the surface, mm
    double depth_mm = 0;       ///< how far it is pushed along direction(), ≥ 0
    double core_mm = 0;        ///< over which its force is spread

    template <class Archive>
    void list_state(Archive& archive) {
      archive(rest, depth_mm, core_mm);
    }
  };

  /// `radius`: the needle's, mm. The surface must outlive this.
  SideContact(const SurfaceBvh& surface, double radius, double max_depth_mm);
  void press_as_one_point() { most_points_ = 1; }

  /// A needle from `hub` to `tip` (mm) that has moved by `motion` and did not touch before: whether it does now.
  bool begin(const Vec3& hub, const Vec3& tip, const Vec3& motion) noexcept;
  /// The same needle `moved_mm` later: false once it is off the tissue.
  bool update(const Vec3& hub, const Vec3& tip, double moved_mm) noexcept;
  /// The needle's edge is off the tissue, its tip, at `tip`, not yet: it touches and does not push.
  void rest_at(const Vec3& tip, const Vec3& axis) noexcept;
  void clear() noexcept { points_.clear(); }

  std::span<const Point> points() const { return points_; }
  /// Unit, across the needle, into the tissue.
  const Vec3& direction() const { return direction_; }
  /// Where the needle's tip presses on the surface beside it; nothing while the tip is off the tissue.
  const std::optional<Vec3>& below_tip() const { return below_tip_; }
  /// The surface's normal at the points, by their depth, outward; not unit.
  const Vec3& normal() const { return normal_; }
  /// Whether a point would have gone farther than the most.
  bool is_saturated() const { return is_saturated_; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(direction_, normal_, below_tip_, is_saturated_, points_);
  }

 private:
  void turn(const Vec3& axis, const Vec3& towards, double share) noexcept;
  bool find_points(const Vec3& hub, const Vec3& tip) noexcept;
  std::optional<SurfaceHit> way_out(const Vec3& from) const noexcept;

  const SurfaceBvh& surface_;
  double radius_, max_depth_, reach_;
  std::size_t most_points_ = kMaxPoints;
  Vec3 direction_ = Vec3::Zero();
  Vec3 normal_ = Vec3::Zero();
  std::optional<Vec3> below_tip_;
  bool is_saturated_ = false;
  std::vector<Point> points_;
};

}  // namespace brachy
