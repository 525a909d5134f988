#pragma once

#include <array>
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
  static constexpr double kFarRadii = 8;  ///< from here on a ring is its centre: 0.2 % of its field there

  /// The kernel must outlive this. `weight`: w of the modulus that near parts are weighted for (remainder.h).
  NearField(const Tissue& tissue, const ElasticKernel& kernel, double weight, SimdTarget target);
  NearField(const Tissue& tissue, const CompactKernel& kernel, double needle_radius, SimdTarget target);

  /// Between two rings of one needle: the mean over their points, mm/N.
  Mat3 between(const NeedleRings& rings, const NeedleRings::Ring& a,
               const NeedleRings::Ring& b) const noexcept;

  /// Rings of a straight piece of shaft, between two landmarks, as two points that carry the same force and the same
  /// moment: for evaluation points farther than kFarPieces of its lengths. A piece of one ring is that ring.
  struct Piece {
    static constexpr double kFarPieces = 1.75;  ///< lengths: 0.2 % of the piece's field there (tests)

    std::uint32_t first = 0, count = 1;  ///< rings
    Vec3 centre;                         ///< mm
    double half_length = 0;              ///< mm
    std::array<Vec3, 2> at, force;       ///< mm, N

    /// Whether to take the two points at this distance from the centre, mm.
    bool is_far(double squared_distance) const {
      const double far = 2 * kFarPieces * half_length;
      return count > 2 && squared_distance > far * far;
    }
  };
  /// `pieces` = those of the rings with these forces (N). Real-time: within its capacity, one for each ring.
  static void take_pieces(const NeedleRings& rings, std::span<const Vec3> ring_forces,
                          std::vector<Piece>& pieces) noexcept;

  /// u += the field of the rings' forces (N) at the points of block b; `pieces` are theirs, `sources` working memory.
  void add_to_block(std::uint32_t b, const NeedleRings& rings, std::span<const Vec3> ring_forces,
                    std::span<const Piece> pieces, std::vector<NearSource>& sources,
                    BlockDisplacement<float>& u) const noexcept;
  /// The same at X, mm, by every ring's points.
  Vec3 displacement_at(const Vec3& X, const NeedleRings& rings,
                       std::span<const Vec3> ring_forces) const noexcept;

  // For the certificate (matrix_kernel_cells.h):
  bool is_far(double distance) const {
    return distance > far_distance_;
  }                      ///< beyond it a ring is replaced by its centre
  double reach() const;  ///< mm, from where on a force displaces nothing
  double scale() const { return scale_; }
  /// Kelvin's solution: the compliance of a lone landmark (core/elasticity/landmark_stiffness.h) times its core, mm²/N.
  double compliance_times_core() const;
  NearBounds bounds() const;  ///< of a force times scale()
  /// Adds the piece's two points to `sources`, about `centre`.
  void add_piece(const NeedleRings& rings, const Piece& piece, const Vec3& centre,
                 std::vector<NearSource>& sources) const noexcept;
  /// Adds the ring's points, or as one its centre, to `sources`, about `centre`.
  void add_sources(const NeedleRings& rings, const NeedleRings::Ring& ring, bool as_one, const Vec3& force,
                   const Vec3& centre, std::vector<NearSource>& sources) const noexcept;
  /// A += ∇u by such sources.
  void add_gradients(const CellPoints& X, std::span<const NearSource> sources,
                     CellGradients& A) const noexcept;
  /// ∇u at X by every ring's points.
  Mat3 gradient_at(const Vec3& X, const NeedleRings& rings, std::span<const Vec3> ring_forces) const noexcept;

  std::size_t bytes() const { return blocks_.points.size() * sizeof(blocks_.points[0]); }

 private:
  NearField(const Tissue& tissue, double scale, double needle_radius, SimdTarget target);
  Mat3 value(const Vec3& x, double s) const noexcept;
  void add_source(const Vec3& at, double s, const Vec3& force, const Vec3& centre,
                  std::vector<NearSource>& sources) const noexcept;

  const Tissue& tissue_;
  const ElasticKernel* elastic_ = nullptr;  // one of these two
  const CompactKernel* compact_ = nullptr;
  CompactShape shape_;
  double scale_;         // of a force: ŵ/μ, over 4π for the loops
  double far_distance_;  // mm
  float kelvin_b_ = 0;   // 1/(4(1 − ν))
  const NearLoops& loops_;
  CentredBlocks blocks_;
};

}  // namespace brachy
