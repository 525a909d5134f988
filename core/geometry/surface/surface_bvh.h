#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// Where a segment a→b crosses the surface, at a + t(b − a).
struct SurfaceHit {
  double t = 0;                ///< 0 at a, 1 at b
  Vec3 point = Vec3::Zero();   ///< mm
  Vec3 normal = Vec3::Zero();  ///< unit, outward, of the triangle
  std::uint32_t triangle = 0;  ///< index in mesh().triangles
  bool entering = false;       ///< from outside to inside
};

/// The surface point nearest to a query point.
struct ClosestPoint {
  Vec3 point = Vec3::Zero();  ///< mm
  /// unit, outward: the angle-weighted pseudo-normal of the face, edge or vertex
  Vec3 normal = Vec3::Zero();
  double signed_distance = 0;  ///< mm, negative inside
  std::uint32_t triangle = 0;  ///< index in mesh().triangles
};

/// Bounding-volume hierarchy over a closed surface wound outward (see prepare_surface), immutable once built.
///
/// Segments are tested as by Woop, Benthin, Wald (Watertight Ray/Triangle Intersection, JCGT 2013) with the sign
/// of every edge function exact and zero decided by a symbolic shift of the segment, so a segment through an edge
/// or vertex crosses exactly one of the triangles that meet there: no crossing is missed or counted twice.
/// Signed distance by Bærentzen, Aanæs (IEEE TVCG 2005).
///
/// Threads: queries are const and may run from any number of threads.
/// Real-time: queries do not allocate, lock or throw. Points that are not finite hit nothing, are not inside, and
/// have a closest point of NaN distance.
class SurfaceBvh {
 public:
  /// Takes a mesh with at least one triangle; indices in range (asserted), vertices finite.
  explicit SurfaceBvh(SurfaceMesh mesh);

  /// The first crossing of the segment a→b (mm), ends included with kEndSlack. Where crossings
  /// coincide to the last bit, the one of the lowest triangle. Nothing where |b − a| < kMinLength.
  std::optional<SurfaceHit> first_hit(const Vec3& a, const Vec3& b) const noexcept;

  /// All crossings in order of t into `out`, the nearest ones if there are more than out.size(); returns how many
  /// were stored. Crossings within kEndSlack of each other that undo each other (a graze) are left out.
  std::size_t all_hits(const Vec3& a, const Vec3& b, std::span<SurfaceHit> out) const noexcept;

  /// The nearest surface point to p (mm) and the signed distance.
  ClosestPoint closest_point(const Vec3& p) const noexcept;

  /// Whether p (mm) is enclosed: the crossings of a ray to the outside, counted with their sign. On the surface
  /// itself the result is unspecified.
  bool inside(const Vec3& p) const noexcept;

  const SurfaceMesh& mesh() const { return mesh_; }
  /// The bounding box, mm; enlarged by 1e-9 of its size.
  const Vec3& min() const { return nodes_[0].min; }
  const Vec3& max() const { return nodes_[0].max; }

  /// A crossing this far (mm) beyond an end of a segment counts as at the end: a path of consecutive segments
  /// may report a crossing at a joint twice, but never misses it.
  static constexpr double kEndSlack = 1e-9;
  static constexpr double kMinLength = 1e-12;  ///< mm; shorter segments hit nothing

  /// Of the tree, guaranteed by the build; sizes the query stacks.
  static constexpr std::size_t kMaxDepth = 64;

 private:
  struct Node {
    Vec3 min, max;
    std::uint32_t first = 0;  ///< leaf: in order_; else the left child, the right one follows it
    std::uint32_t count = 0;  ///< triangles of a leaf; 0 for an inner node
  };
  struct Builder;

  /// Calls visit(t, triangle, entering) for crossings with t in [t_min, t_max]; visit may lower t_max.
  template <class Visit>
  void visit_crossings(const Vec3& a, const Vec3& d, double t_min, double& t_max,
                       Visit&& visit) const noexcept;
  void compute_normals();

  SurfaceMesh mesh_;
  std::vector<Node> nodes_;                               ///< the root first
  std::vector<std::uint32_t> order_;                      ///< triangle indices in the order of the leaves
  std::vector<Vec3> face_normals_;                        ///< unit
  std::vector<Vec3> vertex_normals_;                      ///< angle-weighted sums, not normalised
  std::vector<std::array<std::uint32_t, 3>> neighbours_;  ///< triangle across the edge from corner k to k + 1
};

}  // namespace brachy
