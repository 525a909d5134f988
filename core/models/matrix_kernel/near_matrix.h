#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/models/matrix_kernel/far_pairs.h"
#include "core/models/matrix_kernel/near_field.h"
#include "core/models/matrix_kernel/smooth_field.h"
#include "core/solve/landmark_slots.h"

namespace brachy {

/// What the near part of a kernel adds to K, between landmarks. What is between landmarks whose rings stay is kept: a
/// needle that rests costs nothing.
/// Threads: one. Real-time: no allocation after construction.
class NearMatrix {
 public:
  explicit NearMatrix(std::size_t max_landmarks, SimdTarget target = best_simd_target());

  /// Adds it to K's lower triangle (3 `landmarks` rows). `smooth`: none, or the same field in every call.
  void add_to(Eigen::Ref<Eigen::MatrixXd> K, std::size_t landmarks, const NeedleRings& rings,
              const NearField& near, const SmoothField* smooth) noexcept;

 private:
  /// A ring as one of its landmarks uses it.
  struct Share {
    Vec3 centre, point, axis;
    double across, along, radius, s;
    double
        far_s;  ///< of its piece's first ring, which stands for all of them far away, and may be a neighbour's
    bool is_landmark;
    double key() const { return centre.x() + 2 * centre.y() + 3 * centre.z() + across + point.x(); }
    bool operator==(const Share&) const = default;
  };

  /// Rings of one piece of shaft, and the two points that stand for it far away: shares of its two landmarks in each.
  struct Piece {
    std::uint32_t first, count;
    std::uint32_t shaft;  // counts
    std::array<std::uint32_t, 2> landmark;
    double squared_far, squared_far_aside;  // mm²: on the same shaft, and on others
    Vec3 centre;
    std::array<Vec3, 2> at;
    Vec3 axis;
    bool is_even;                                        // shares along the shaft are those across it
    std::array<std::array<double, 2>, 2> across, along;  // shares by point, then side

    bool is_far_from(const Piece& other) const {
      const double distance2 = (centre - other.centre).squaredNorm();
      return shaft == other.shaft ? distance2 > std::max(squared_far, other.squared_far)
                                  : distance2 > std::max(squared_far_aside, other.squared_far_aside);
    }
    /// As NeedleRings::Ring's.
    Mat3 share(std::size_t point, std::size_t side) const {
      return across[point][side] * Mat3::Identity() +
             (along[point][side] - across[point][side]) * axis * axis.transpose();
    }
  };

  void find_fresh(std::size_t landmarks, const NeedleRings& rings) noexcept;
  bool is_asked(const Piece& a, const Piece& b) const noexcept;
  void take_pieces(const NeedleRings& rings, double far_ring, const SmoothField* smooth) noexcept;
  void add_pair(std::size_t i, std::size_t j, const NeedleRings& rings, const NearField& near,
                const SmoothField* smooth) noexcept;
  void add_far(const Piece& a, const Piece& b, const NeedleRings& rings, const NearField& near,
               const SmoothField* smooth) noexcept;
  void take_far(const Piece& a, const Piece& b, const NeedleRings& rings, const SmoothField* smooth) noexcept;
  void add_taken(const NearField& near) noexcept;
  void add(std::uint32_t l, std::uint32_t m, const Mat3& part) noexcept;

  bool is_fresh(std::uint32_t l, std::uint32_t m) const {
    return l >= m && fresh_pairs_[l * count_ + m] != 0;
  }
  Mat3& kept(std::size_t l, std::size_t m) {
    return blocks_[slots_.slot(m) * max_landmarks_ + slots_.slot(l)];
  }

  const std::size_t max_landmarks_;
  const FarPairLoop far_pair_loop_;
  LandmarkSlots<Share> slots_;
  std::size_t count_ = 0;                  // landmarks
  std::vector<std::uint8_t> fresh_pairs_;  // of landmarks, count_ a row
  std::vector<std::uint8_t> has_fresh_;    // landmarks that are in one
  std::vector<Piece> pieces_;
  std::vector<Mat3> blocks_;  // of pairs, by slots

  FarPairs far_;  // pairs of pieces that are summed together …
  std::array<std::array<const Piece*, 2>, FarPairs::kCount> far_pieces_;
  std::size_t far_count_ = 0;  // … and how many there are
};

}  // namespace brachy
