#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/solve/assembly_loops.h"

namespace brachy {

/// An elimination order for landmarks of one support radius a: a sweep along the direction in which they spread most.
/// Row i of K then begins at its first neighbour (the earliest landmark nearer than a), and L fills nothing left of
/// it: the envelope (George & Liu, Computer Solution of Large Sparse Positive Definite Systems, 1981, ch. 4).
/// For landmarks in a volume the front of the sweep is as thin as a separator can be, since that too must be a thick;
/// nested dissection and minimum degree gave no fewer operations there.
/// Threads: one. Real-time: no allocation after construction.
class SweepOrder {
 public:
  SweepOrder(const AssemblyLoops& loops, int capacity);

  /// Orders `positions` (n ≤ capacity, mm).
  void compute(std::span<const Vec3> positions, double support_radius) noexcept;

  std::span<const int> order() const { return order_; }  ///< n: landmark of each row
  std::span<const int> first_neighbours() const {
    return first_neighbours_;
  }  ///< n: column where each row begins
  /// Approximate operations of a factorisation within the envelope, as a share of a dense one's.
  double fill_estimate() const;

 private:
  void sort_along(const Vec3& direction, std::span<const Vec3> positions) noexcept;
  void find_reach(double support_radius) noexcept;
  void find_first_neighbours(std::span<const Vec3> positions, double support_radius) noexcept;
  void sort_windows() noexcept;

  const AssemblyLoops& loops_;
  std::vector<std::pair<double, int>> keys_;  // coordinate along the sweep, landmark
  std::vector<std::pair<int, int>> window_;   // first neighbour, landmark
  std::vector<double> x_, y_, z_;             // positions in the order
  std::vector<int> order_, first_neighbours_;
};

}  // namespace brachy
