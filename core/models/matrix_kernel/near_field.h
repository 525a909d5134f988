#pragma once

#include <array>
#include <limits>
#include <span>
#include <vector>

#include "core/elasticity/compact/compact_kernel.h"
#include "core/elasticity/elastic_kernel.h"
#include "core/elasticity/needle_rings.h"
#include "core/geometry/tissue/tissue.h"
#include "core/models/matrix_kernel/centred_blocks.h"
#include "core/models/matrix_kernel/near_bounds.h"
#include "core/models/matrix_kernel/near_loops.h"

namespace brachy {

/// `kernel` in the form of the loops: without its compliance.
CompactShape shape_of(const CompactKernel& kernel);

/// The near part of a matrix model's kernel: Kelvin's solution, weighted for one modulus, or the compact
/// kernel, between the rings of a needle and from them at a tissue's points. A ring is summed over its points for near
/// evaluation points, and replaced by its centre for those farther than kFarRadii.
/// Threads: const functions may be called from any. Real-time: they do not allocate within `sources`' capacity.
class NearField {
 public:
  static constexpr double kFarRadii =
      8;  ///< from here on a ring is its centre: 0.5 % of its field there (tests)

  /// The kernel must outlive this. `weight`: w of the modulus that near parts are weighted for (remainder.h).
  NearField(const Tissue& tissue, const ElasticKernel& kernel, double weight, SimdTarget target);
  NearField(const Tissue& tissue, const CompactKernel& kernel, double needle_radius, SimdTarget target);

  /// Between two rings of one needle: the mean over their points, mm/N.
  Mat3 between(const NeedleRings& rings, const NeedleRings::Ring& a,
               const NeedleRings::Ring& b) const noexcept;

  /// Between two points x mm apart, mm/N.
  Mat3 value(const Vec3& x, double s) const noexcept;
  /// At x mm from a point of PointCore::of_correction, mm/N.
  Mat3 of_correction(const Vec3& x, const PointCore& core) const noexcept {
    return value(x, core.s) - value(x, core.counter_s);
  }

  /// A force that stands for several.
  struct Point {
    Vec3 at, force;  ///< mm, N
    double s = 0;    ///< mm²
  };

  /// Rings of a straight piece of shaft, between two landmarks, as two points that carry the same force and the same
  /// moment: for evaluation points farther than kFarPieces of its lengths. A piece of one ring is that ring.
  /// Nearer, but farther than kFarPairs radii from two neighbouring rings, these are one point: their six points each
  /// lie as far aside of it as they do along the shaft where rings lie √2 radii apart, and Kelvin's solution averaged
  /// over all directions with the variance v is the one of s + 2 v.
  struct Piece {
    static constexpr double kFarPieces = 1.75;  ///< lengths: 0.2 % of the piece's field there (tests)
    static constexpr double kFarPairs = 4;      ///< radii: 0.6 % of the pair's field there (tests)
    static constexpr double kEven =
        0.2;  ///< of the variance aside: pairs whose variance along differs more are none

    std::uint32_t first = 0, count = 1;                      ///< rings
    Vec3 centre;                                             ///< mm
    double half_length = 0;                                  ///< mm
    double size = 0;                                         ///< of all its rings' forces, N
    double reach = std::numeric_limits<double>::infinity();  ///< mm, from the centre: beyond, it is left out
    std::array<Point, 2> whole;
    std::uint32_t pair_count = 0;  ///< of rings first and first + 1, and so on; 0: none
    std::array<Point, NeedleRings::kMaxRingsBetween / 2> pairs;

    /// mm²: beyond this from the centre the two points are taken.
    double squared_far() const {
      const double far = 2 * kFarPieces * half_length;
      return count > 2 ? far * far : std::numeric_limits<double>::infinity();
    }
    bool is_far(double squared_distance) const { return squared_distance > squared_far(); }
    bool reaches(double squared_distance) const { return squared_distance <= reach * reach; }
  };
  /// `pieces` = those of the rings with these forces (N). Real-time: within its capacity, one for each ring.
  static void take_pieces(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                          std::vector<Piece>& pieces) noexcept;

  /// u += the field of the rings' forces (N) at the points of block b; `pieces` are theirs, `sources` working memory.
  void add_to_block(std::uint32_t b, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                    std::span<const Piece> pieces, std::vector<NearSource>& sources,
                    BlockDisplacement<float>& u) const noexcept;
  /// The same at points X (mm about `centre`) that lie within `box`. `count`: only the first so many are asked for.
  void add_to_points(const BlockPoints<float>& X, const Vec3& centre, const Block& box,
                     const NeedleRings& rings, std::span<const Vec3> ring_forces,
                     std::span<const Piece> pieces, std::vector<NearSource>& sources,
                     BlockDisplacement<float>& u, std::size_t count = Tissue::kBlockSize) const noexcept;
  const CentredBlocks& blocks() const { return blocks_; }  ///< the tissue's
  /// The same at X, mm, by every ring's points.
  Vec3 displacement_at(const Vec3& X, const NeedleRings& rings,
                       std::span<const Vec3> ring_forces) const noexcept;

  // For the certificate (matrix_kernel_cells.h):
  double far_distance() const { return far_distance_; }  ///< mm: beyond it a ring is replaced by its centre
  bool is_far(double distance) const { return distance > far_distance_; }
  double reach() const;  ///< mm, from where on a force displaces nothing
  double scale() const { return scale_; }
  bool is_kelvin() const { return elastic_ != nullptr; }  ///< else a compact kernel
  double kelvin_share() const;                            ///< b of kelvin.h, of Kelvin's solution
  /// Kelvin's solution: the compliance of a lone landmark (core/elasticity/landmark_stiffness.h) times its core, mm²/N.
  double compliance_times_core() const;
  NearBounds bounds() const;  ///< of a force times scale()
  /// Adds what stands for the piece at places that far (squared_distance(point), mm²) to `sources`, about `centre`.
  /// Roughly: no ring as its six points.
  template <class SquaredDistance>
  void add_sources(const NeedleRings& rings, std::span<const Vec3> ring_forces, const Piece& piece,
                   const SquaredDistance& squared_distance, const Vec3& centre, bool roughly,
                   std::vector<NearSource>& sources) const noexcept;
  /// A += ∇u by such sources.
  void add_gradients(const CellPoints& X, std::span<const NearSource> sources,
                     CellGradients& A) const noexcept;
  /// ∇u at X by every ring's points.
  Mat3 gradient_at(const Vec3& X, const NeedleRings& rings, std::span<const Vec3> ring_forces) const noexcept;
  /// ∇u at X of the field as blocks have it: far pieces and rings by what stands for them.
  Mat3 gradient_at(const Vec3& X, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                   std::span<const Piece> pieces) const noexcept;

  std::size_t bytes() const { return blocks_.points.size() * sizeof(blocks_.points[0]); }

 private:
  NearField(const Tissue& tissue, double scale, double needle_radius, SimdTarget target);
  Mat3 gradient(const Vec3& x, double s, const Vec3& force) const noexcept;
  Mat3 between_coaxial(const NeedleRings& rings, const NeedleRings::Ring& a, const NeedleRings::Ring& b,
                       double s) const noexcept;
  static void take_pairs(std::span<const NeedleRings::Ring> rings, std::span<const Vec3> forces,
                         Piece& piece) noexcept;
  template <class SquaredDistance, class VisitPoint, class VisitRing>
  void visit_sources(const NeedleRings& rings, std::span<const Vec3> ring_forces, const Piece& piece,
                     const SquaredDistance& squared_distance, const VisitPoint& visit_point,
                     const VisitRing& visit_ring) const noexcept;
  void add_ring(const NeedleRings& rings, const NeedleRings::Ring& ring, bool as_one, const Vec3& force,
                const Vec3& centre, std::vector<NearSource>& sources) const noexcept;
  void add_source(const Point& point, const Vec3& centre, std::vector<NearSource>& sources) const noexcept;
  Eigen::Vector3f of_loops(const Vec3& force) const { return (loop_scale_ * force).cast<float>(); }

  const Tissue& tissue_;
  const ElasticKernel* elastic_ = nullptr;  // one of these two
  const CompactKernel* compact_ = nullptr;
  CompactShape shape_;
  double scale_;         // of a force: ŵ/μ
  double loop_scale_;    // the same over 4π for Kelvin's solution, as the loops want it
  double far_distance_;  // mm
  double far_pair2_;     // mm²
  float kelvin_b_ = 0;   // 1/(4(1 − ν))
  const NearLoops& loops_;
  CentredBlocks blocks_;
};

// Points that stand for several rings, and rings, each with whether it is far enough to be its centre.
template <class SquaredDistance, class VisitPoint, class VisitRing>
void NearField::visit_sources(const NeedleRings& rings, std::span<const Vec3> ring_forces, const Piece& piece,
                              const SquaredDistance& squared_distance, const VisitPoint& visit_point,
                              const VisitRing& visit_ring) const noexcept {
  if (piece.is_far(squared_distance(piece.centre))) {
    for (const Point& point : piece.whole) visit_point(point);
    return;
  }
  const std::uint32_t end = piece.first + piece.count;
  for (std::uint32_t r = piece.first; r < end; ++r) {
    const std::uint32_t pair = (r - piece.first) / 2;
    if (pair < piece.pair_count && (r - piece.first) % 2 == 0 &&
        squared_distance(piece.pairs[pair].at) > far_pair2_) {
      visit_point(piece.pairs[pair]);
      ++r;
      continue;
    }
    const NeedleRings::Ring& ring = rings.rings()[r];
    visit_ring(ring, ring_forces[r],
               ring.count == 1 || squared_distance(ring.centre) > far_distance_ * far_distance_);
  }
}

template <class SquaredDistance>
void NearField::add_sources(const NeedleRings& rings, std::span<const Vec3> ring_forces, const Piece& piece,
                            const SquaredDistance& squared_distance, const Vec3& centre, bool roughly,
                            std::vector<NearSource>& sources) const noexcept {
  visit_sources(
      rings, ring_forces, piece, squared_distance,
      [&](const Point& point) { add_source(point, centre, sources); },
      [&](const NeedleRings::Ring& ring, const Vec3& force, bool is_far) {
        add_ring(rings, ring, roughly || is_far, force, centre, sources);
      });
}

}  // namespace brachy
