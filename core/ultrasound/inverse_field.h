#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/models/displacement_field.h"
#include "core/needle/body_frame.h"
#include "core/ultrasound/image_plane.h"

namespace brachy {

/// The material points X of an image plane: X + u(X) = y at the nodes of a square grid over the scan, and between them
/// by interpolation; with their change across the plane.
///
/// Broyden's method at each node, which needs no gradient of u: X ← X − B (X + u(X) − y), B ≈ (I + ∇u)⁻¹ by rank-one
/// updates (C. G. Broyden, Math. Comp. 19, 1965). It starts from rest, or from the last plane's solution and B, going
/// on as from the plane before that. Nodes are solved in patches, so that the field evaluates points together that lie
/// together.
/// Threads: one. Real-time: no allocation after construction; at most kMostSteps evaluations of a node.
class InverseField {
 public:
  static constexpr double kSpacingMm = 2;
  static constexpr double kToleranceMm = 0.01;  ///< of X + u(X) from y
  static constexpr int kMostSteps = 12;

  explicit InverseField(const ImagePlane& plane, double spacing_mm = kSpacingMm);

  /// Starts from rest at the next solve: what is found then depends on that plane and field alone.
  void reset() noexcept { is_started_ = false; }

  /// Solves for the plane at X_WI. `field`: in the frame of the body, which is at `frame`. Returns whether all nodes
  /// within the scan are within kToleranceMm; those that are not keep the nearest X that was found.
  bool solve(DisplacementField& field, const BodyFrame& frame, const RigidTransform& X_WI) noexcept;

  double worst_residual_mm() const { return worst_; }       ///< of the last solve
  std::size_t evaluations() const { return evaluations_; }  ///< of u, in the last solve
  std::size_t node_count() const { return active_.size(); }

  struct Sample {
    Vec3 X;       ///< mm, material
    Vec3 X_by_n;  ///< its change for each mm across the plane
  };
  /// Between the nodes, bicubic in X; X_by_n is known at every second of them. Only for places within the scan.
  Sample at(const PlanePoint& p) const noexcept;

  /// The same on a grid twice as fine, all nodes of a patch of it: its column and row 0 are those of the nodes, and
  /// `column` and `row`, of its first, are even and at least 2. Beyond the scan: any numbers.
  struct Patch {
    static constexpr std::size_t kSide = 8;
    float X[3][kSide][kSide], by_n[3][kSide][kSide];  ///< by rows
  };
  void find(std::size_t column, std::size_t row, Patch& patch) const noexcept;
  double left_mm() const { return left_; }      ///< of column 0
  double bottom_mm() const { return bottom_; }  ///< of row 0

 private:
  struct Node {
    PlanePoint place;
    Vec3 y = Vec3::Zero(), X = Vec3::Zero(), by_n = Vec3::UnitZ();
    Vec3 residual = Vec3::Zero(), step = Vec3::Zero();
    Vec3 last = Vec3::Zero();   // X − y of the last plane
    Vec3 drift = Vec3::Zero();  // of that, from the plane before the last
    Mat3 B = Mat3::Identity();
    bool is_active = false;
  };
  void evaluate(DisplacementField& field, std::span<const std::uint32_t> nodes) noexcept;

  double spacing_, left_, bottom_;
  std::size_t columns_ = 0, rows_ = 0;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> active_, open_;  // in the order of patches
  std::vector<std::uint32_t> sparse_;         // every second of each row and column: where by_n is known
  std::vector<Vec3> X_, u_;
  bool is_started_ = false;
  double worst_ = 0;
  std::size_t evaluations_ = 0;
};

}  // namespace brachy
