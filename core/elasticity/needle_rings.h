#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/kernels/landmark_spread.h"
#include "core/kernels/point_groups.h"

namespace brachy {

/// Landmarks on a needle as an elastic kernel wants them (apps/lab/reference/MODEL_STUDY.md).
///
/// On a shaft, which is two or more consecutive landmarks along a line: rings of six points on the needle's surface,
/// at each landmark and, where they are more than 1.5 R apart, between them. Each landmark's force is spread over the
/// rings up to its neighbours, falling linearly, and its displacement is observed by the same weights: a rigid cylinder
/// is moved by tractions on its surface, and points of its axis have either its resistance or its far field, not both.
/// The rings at the shaft's ends lie 0.3 R inward, where a round end is 0.714 R wide. A shaft shorter than 2 R is too
/// short for round ends: the shorter, the nearer are its end rings to a cylinder's rims, and they carry its flat ends.
/// Core of a point 0.40 √A, A its share of the surface: a lattice of points that carries a surface force then moves as
/// the smooth layer does (by theory 0.385, for any ν).
/// Alone: a contact; one point of core (4/π) R, the resistance of a rigid disc of radius R.
/// With a core c of its own: one point of that core, which boundary and regions see as a point: what they add varies
/// little over it, and the tissue ends within it. Tissue at the
/// landmark goes as far as the landmark does, and folds at 2.57 cores (core/DESIGN.md, section 4).
/// A tip with a core that continues a shaft: such a point for its force along the shaft; for what is across, the shaft
/// goes on to the tip, because a needle's steel is as thick there as elsewhere.
/// A needle's tip with a core that is alone: the core for its force along the needle, LandmarkSpread::across_mm across.
/// Threads: one. Real-time: build does not allocate where reserve was called for as many landmarks.
class NeedleRings {
 public:
  static constexpr std::size_t kPoints = 6;  ///< of a ring
  static constexpr double kSpacing = 1.5;    ///< most, in radii
  /// two landmarks; rings of a thin needle then lie farther apart
  static constexpr int kMaxRingsBetween = 12;
  static constexpr double kEndInset = 0.3;           ///< radii
  static constexpr double kCore = 0.40;              ///< in roots of a point's area
  static constexpr double kDiscCore = 1.2732395447;  ///< 4/π radii
  /// Consecutive landmarks belong to one shaft when they lie at most this far apart: 12 mm or 12 radii,
  /// whichever is more, and the line through them turns by less than 30° at each.
  static constexpr double kMaxGap = 12;

  struct Ring {
    Vec3 centre;                              ///< mm
    Vec3 axis;                                ///< unit, or 0 for a single point
    double radius = 0;                        ///< mm; 0: a single point
    PointCore core;                           ///< of each of its points
    std::uint32_t first = 0, count = 1;       ///< its points
    std::array<std::uint32_t, 2> landmark{};  ///< the one or two whose force it carries
    /// Their shares in it across `axis` and along it, and as boundary and regions see them, which is without the way
    /// from a shaft to a tip with a core. Each of a landmark's sum to 1 over its rings.
    std::array<double, 2> across{}, along{}, smooth{};

    bool carries(std::size_t side) const { return across[side] > 0 || along[side] > 0; }
    bool is_even(std::size_t side) const { return across[side] == along[side]; }
    /// What the ring carries of a force `f` on its landmark, and what that landmark observes of a displacement f.
    Vec3 share(std::size_t side, const Vec3& f) const {
      return across[side] * f + (along[side] - across[side]) * axis.dot(f) * axis;
    }
    /// The same as a matrix.
    Mat3 share(std::size_t side) const {
      return across[side] * Mat3::Identity() + (along[side] - across[side]) * axis * axis.transpose();
    }
  };

  /// Reserves memory for `landmarks` landmarks.
  void reserve(std::size_t landmarks);

  /// For landmarks at `positions` (n, mm) on a needle of `radius` mm. `cores`: of each, mm, or 0 for the
  /// rule; empty: the rule for all. `spreads`: which are tips that continue a shaft; empty: none.
  void build(std::span<const Vec3> positions, std::span<const double> cores, double radius,
             std::span<const LandmarkSpread> spreads = {});

  /// Every other ring of a shaft is turned by half its points' distance. Of up to so many landmarks the first ring of a
  /// shaft goes on from the shaft before; of more, it is as it would be alone, so that what is known of one needle's
  /// rings does not change with another's.
  static constexpr std::size_t kGoesOnUpTo = 40;

  /// Gives ring `r`, a single point with a core of its own, another one, mm. Nothing else changes.
  void set_core(std::size_t r, double core) noexcept;

  void clear() noexcept;
  /// Adds a point with a core of its own that carries a force for `landmark`.
  void add_point(const Vec3& position, const PointCore& core, std::uint32_t landmark);
  /// Adds the rings of `others` after these, for the same landmarks.
  void append(const NeedleRings& others);
  /// Moves ring `r` with its points, mm. Its axis stays.
  void move(std::size_t r, const Vec3& by) noexcept;

  std::span<const Ring> rings() const { return rings_; }
  /// Rings that follow one another between the same two landmarks. A single point is a piece of its own.
  struct Piece {
    std::uint32_t first, count;
    Vec3 centre;         ///< mm
    double half_length;  ///< mm, from there to its last ring
    double arm;          ///< mm, root mean square of its rings' distances from there
  };
  /// The one that begins with ring `first`, of the first `count` rings.
  Piece piece_at(std::size_t first, std::size_t count) const;
  std::span<const Vec3> points() const { return points_; }
  std::span<const Vec3> points(const Ring& ring) const { return points().subspan(ring.first, ring.count); }

  /// Adds the points that carry a landmark's force, as boundary and regions see it, to the group that is open there.
  void add_to(PointGroups& groups, std::uint32_t landmark) const;
  /// The same as groups, one a landmark.
  PointGroups groups(std::size_t landmarks) const;

 private:
  void add_shaft(std::span<const Vec3> positions, std::span<const double> cores, bool has_tip, double radius);
  void add_lone(const Vec3& position, double core, double radius, std::uint32_t landmark,
                const LandmarkSpread& spread);
  void add_ring(const Vec3& centre, const Vec3& axis, double radius, double spacing, bool turned);
  void normalize(std::size_t first_ring);

  bool goes_on_ = true;
  std::vector<Ring> rings_;
  std::vector<Vec3> points_;
  std::vector<double> spacing_;       // of each ring: the length of shaft it stands for, mm
  std::vector<std::uint32_t> shaft_;  // the landmarks of that in work
};

}  // namespace brachy
