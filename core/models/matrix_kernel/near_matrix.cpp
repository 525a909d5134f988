#include "core/models/matrix_kernel/near_matrix.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brachy {

using Eigen::Index;

NearMatrix::NearMatrix(std::size_t max_landmarks)
    : shares_(max_landmarks), last_shares_(max_landmarks), is_fresh_(max_landmarks, 0) {
  // Its own and those of the ways to its neighbours, with a tip's point.
  for (auto* shares : {&shares_, &last_shares_})
    for (std::vector<Share>& of_landmark : *shares)
      of_landmark.reserve(2 * NeedleRings::kMaxRingsBetween + 2);
  pieces_.reserve(max_landmarks * (NeedleRings::kMaxRingsBetween + 2));
  const auto rows = static_cast<Index>(3 * max_landmarks);
  matrix_.setZero(rows, rows);
}

void NearMatrix::find_fresh(std::size_t landmarks, const NeedleRings& rings) noexcept {
  for (std::size_t l = 0; l < landmarks; ++l) shares_[l].clear();
  for (const NeedleRings::Ring& ring : rings.rings())
    for (std::size_t side = 0; side < 2; ++side)
      if (ring.carries(side))
        shares_[ring.landmark[side]].push_back({ring.centre, rings.points(ring).front(), ring.axis,
                                                ring.across[side], ring.along[side], ring.radius, ring.core.s,
                                                ring.core.is_landmark});
  for (std::size_t l = 0; l < landmarks; ++l)
    is_fresh_[l] = l >= last_landmarks_ || shares_[l] != last_shares_[l];
  last_landmarks_ = landmarks;
  std::swap(shares_, last_shares_);
}

// As NearField::take_pieces, with the landmarks' shares in place of forces.
void NearMatrix::take_pieces(const NeedleRings& rings, double far_ring, const SmoothField* smooth) noexcept {
  pieces_.clear();
  const auto all = rings.rings();
  const auto count = static_cast<std::uint32_t>(all.size());
  for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
    const NeedleRings::Ring& ring = all[begin];
    for (end = begin + 1; end < count && ring.count > 1 && all[end].landmark == ring.landmark;) ++end;
    Piece& piece = pieces_.emplace_back();
    piece.first = begin;
    piece.count = end - begin;
    piece.landmark = ring.landmark;
    piece.is_fresh = is_fresh_[ring.landmark[0]] || is_fresh_[ring.landmark[1]];
    piece.centre = 0.5 * (ring.centre + all[end - 1].centre);
    const double half = 0.5 * (all[end - 1].centre - ring.centre).norm();
    std::array<double, 2> whole{}, moment{};
    double square = 0;
    bool is_even = true;
    for (std::uint32_t r = begin; r < end; ++r) {
      const double t = (all[r].centre - piece.centre).dot(ring.axis);
      square += t * t / piece.count;
      for (std::size_t side = 0; side < 2; ++side) {
        whole[side] += all[r].across[side];
        moment[side] += t * all[r].across[side];
        is_even = is_even && all[r].is_even(side) &&
                  (!smooth || smooth->near_factor(r, side) == smooth->near_factor(begin, side));
      }
    }
    // Of a tip with a core the shares along the shaft are others than those across it; a shaft may leave the gland.
    const double far = piece.count > 2 ? 2 * NearField::Piece::kFarPieces * half : far_ring + half;
    piece.squared_far = is_even ? far * far : std::numeric_limits<double>::infinity();
    const double arm = std::sqrt(square);
    for (std::size_t k = 0; k < 2; ++k) {
      const double where = k == 0 ? -1 : 1;
      piece.at[k] = piece.centre + where * arm * ring.axis;
      for (std::size_t side = 0; side < 2; ++side)
        piece.share[k][side] = 0.5 * (whole[side] + (arm > 0 ? where / arm * moment[side] : 0));
    }
  }
}

void NearMatrix::add_to(Eigen::Ref<Eigen::MatrixXd> K, std::size_t landmarks, const NeedleRings& rings,
                        const NearField& near, const SmoothField* smooth) noexcept {
  find_fresh(landmarks, rings);
  for (std::size_t l = 0; l < landmarks; ++l)
    for (std::size_t m = 0; m <= l; ++m)
      if (is_fresh_[l] || is_fresh_[m])
        matrix_.block<3, 3>(3 * static_cast<Index>(l), 3 * static_cast<Index>(m)).setZero();
  take_pieces(rings, near.far_distance(), smooth);
  for (std::size_t p = 0; p < pieces_.size(); ++p)
    for (std::size_t q = 0; q <= p; ++q) {
      const Piece &a = pieces_[p], &b = pieces_[q];
      if (!a.is_fresh && !b.is_fresh) continue;
      if ((a.centre - b.centre).squaredNorm() > std::max(a.squared_far, b.squared_far)) {
        add_far(a, b, rings, near, smooth);
        continue;
      }
      for (std::uint32_t i = a.first; i < a.first + a.count; ++i)
        for (std::uint32_t j = b.first; j < (p == q ? i + 1 : b.first + b.count); ++j)
          add_pair(i, j, rings, near, smooth);
    }
  K.triangularView<Eigen::Lower>() += matrix_.topLeftCorner(K.rows(), K.cols());
}

void NearMatrix::add(std::uint32_t l, std::uint32_t m, const Mat3& part) noexcept {
  if (l >= m) matrix_.block<3, 3>(3 * static_cast<Index>(l), 3 * static_cast<Index>(m)) += part;
}

void NearMatrix::add_far(const Piece& a, const Piece& b, const NeedleRings& rings, const NearField& near,
                         const SmoothField* smooth) noexcept {
  const NeedleRings::Ring &from = rings.rings()[a.first], &to = rings.rings()[b.first];
  const double s_between = from.core.with(to.core);
  std::array<std::array<Mat3, 2>, 2> value;
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t q = 0; q < 2; ++q) value[k][q] = near.between(a.at[k] - b.at[q], s_between);
  for (std::size_t s = 0; s < 2; ++s)
    for (std::size_t t = 0; t < 2; ++t) {
      const std::uint32_t l = a.landmark[s], m = b.landmark[t];
      if (!is_fresh_[l] && !is_fresh_[m]) continue;
      const double weight = smooth ? smooth->near_factor(a.first, s, b.first, t) : 1;
      Mat3 sum = Mat3::Zero();
      for (std::size_t k = 0; k < 2; ++k)
        for (std::size_t q = 0; q < 2; ++q) sum += (weight * a.share[k][s] * b.share[q][t]) * value[k][q];
      add(l, m, sum);
      add(m, l, sum.transpose());
    }
}

void NearMatrix::add_pair(std::size_t i, std::size_t j, const NeedleRings& rings, const NearField& near,
                          const SmoothField* smooth) noexcept {
  const NeedleRings::Ring &a = rings.rings()[i], &b = rings.rings()[j];
  const Mat3 value = near.between(rings, a, b);
  for (std::size_t s = 0; s < 2; ++s)
    for (std::size_t t = 0; t < 2; ++t) {
      if (!a.carries(s) || !b.carries(t)) continue;
      const std::uint32_t l = a.landmark[s], m = b.landmark[t];
      if (!is_fresh_[l] && !is_fresh_[m]) continue;
      const double weight = smooth ? smooth->near_factor(i, s, j, t) : 1;
      const Mat3 shared = a.is_even(s) && b.is_even(t) ? Mat3(weight * a.across[s] * b.across[t] * value)
                                                       : Mat3(weight * a.share(s) * value * b.share(t));
      add(l, m, shared);
      if (i != j) add(m, l, shared.transpose());
    }
}

}  // namespace brachy
