#include "core/models/matrix_kernel/near_matrix.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brachy {

using Eigen::Index;

namespace {

// Lengths of a piece from which on two points stand for it, to other shafts.
constexpr double kFarAside = 1.25;

}  // namespace

// Shares of a landmark: its own and those of the ways to its neighbours, with a tip's point.
NearMatrix::NearMatrix(std::size_t max_landmarks, SimdTarget target)
    : max_landmarks_(max_landmarks),
      far_pair_loop_(far_pair_loop(target)),
      slots_(max_landmarks, 2 * NeedleRings::kMaxRingsBetween + 2),
      fresh_pairs_(max_landmarks * max_landmarks, 0),
      has_fresh_(max_landmarks, 0),
      blocks_(max_landmarks * max_landmarks, Mat3::Zero()),
      far_{} {
  pieces_.reserve(max_landmarks * (NeedleRings::kMaxRingsBetween + 2));
}

void NearMatrix::find_fresh(std::size_t landmarks, const NeedleRings& rings) noexcept {
  count_ = landmarks;
  slots_.begin(landmarks);
  const auto all = rings.rings();
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    end = begin + rings.piece_at(begin, all.size()).count;
    for (std::size_t r = begin; r < end; ++r)
      for (std::size_t side = 0; side < 2; ++side)
        if (all[r].carries(side))
          slots_.add(all[r].landmark[side], {all[r].centre, rings.points(all[r]).front(), all[r].axis,
                                             all[r].across[side], all[r].along[side], all[r].radius,
                                             all[r].core.s, all[begin].core.s, all[r].core.is_landmark});
  }
  slots_.find();
  std::fill_n(has_fresh_.begin(), landmarks, std::uint8_t{0});
  for (std::size_t l = 0; l < landmarks; ++l)
    for (std::size_t m = 0; m <= l; ++m) {
      const bool fresh = slots_.take_pair(l, m);
      fresh_pairs_[l * count_ + m] = fresh ? 1 : 0;
      if (!fresh) continue;
      has_fresh_[l] = has_fresh_[m] = 1;
      kept(l, m).setZero();
    }
}

bool NearMatrix::is_asked(const Piece& a, const Piece& b) const noexcept {
  for (const std::uint32_t l : a.landmark)
    for (const std::uint32_t m : b.landmark)
      if (is_fresh(std::max(l, m), std::min(l, m))) return true;
  return false;
}

// As NearField::take_pieces, with the landmarks' shares in place of forces.
void NearMatrix::take_pieces(const NeedleRings& rings, double far_ring, const SmoothField* smooth) noexcept {
  pieces_.clear();
  const auto all = rings.rings();
  const auto count = static_cast<std::uint32_t>(all.size());
  for (std::uint32_t begin = 0, end = 0; begin < count; begin = end) {
    const NeedleRings::Ring& ring = all[begin];
    const NeedleRings::Piece of_rings = rings.piece_at(begin, count);
    end = begin + of_rings.count;
    Piece& piece = pieces_.emplace_back();
    piece.first = begin;
    piece.count = of_rings.count;
    piece.landmark = ring.landmark;
    piece.shaft = 0;
    if (pieces_.size() > 1) {
      const Piece& last = pieces_[pieces_.size() - 2];
      const bool goes_on = std::ranges::find(last.landmark, ring.landmark[0]) != last.landmark.end() ||
                           std::ranges::find(last.landmark, ring.landmark[1]) != last.landmark.end();
      piece.shaft = last.shaft + (goes_on ? 0 : 1);
    }
    piece.centre = of_rings.centre;
    piece.axis = ring.axis;
    piece.is_even = true;
    std::array<double, 2> across{}, along{}, across_moment{}, along_moment{};
    bool is_one_tissue = true;
    for (std::uint32_t r = begin; r < end; ++r) {
      const double t = (all[r].centre - piece.centre).dot(ring.axis);
      for (std::size_t side = 0; side < 2; ++side) {
        across[side] += all[r].across[side];
        along[side] += all[r].along[side];
        across_moment[side] += t * all[r].across[side];
        along_moment[side] += t * all[r].along[side];
        piece.is_even = piece.is_even && all[r].is_even(side);
        is_one_tissue =
            is_one_tissue && (!smooth || smooth->near_factor(r, side) == smooth->near_factor(begin, side));
      }
    }
    // A shaft may leave the gland. Shares that end at a tip with a core are not even, and along their own shaft two
    // points do not stand for them: K would not stay definite.
    constexpr double kNever = std::numeric_limits<double>::infinity();
    const auto far = [&](double lengths) {
      return piece.count > 2 ? 2 * lengths * of_rings.half_length : far_ring + of_rings.half_length;
    };
    piece.squared_far =
        is_one_tissue && piece.is_even ? std::pow(far(NearField::Piece::kFarPieces), 2) : kNever;
    piece.squared_far_aside = is_one_tissue ? std::pow(far(kFarAside), 2) : kNever;
    const double arm = of_rings.arm;
    for (std::size_t k = 0; k < 2; ++k) {
      const double where = k == 0 ? -1 : 1;
      piece.at[k] = piece.centre + where * arm * ring.axis;
      for (std::size_t side = 0; side < 2; ++side) {
        const double lever = arm > 0 ? where / arm : 0;
        piece.across[k][side] = 0.5 * (across[side] + lever * across_moment[side]);
        piece.along[k][side] = 0.5 * (along[side] + lever * along_moment[side]);
      }
    }
  }
}

void NearMatrix::add_to(Eigen::Ref<Eigen::MatrixXd> K, std::size_t landmarks, const NeedleRings& rings,
                        const NearField& near, const SmoothField* smooth) noexcept {
  find_fresh(landmarks, rings);
  take_pieces(rings, near.far_distance(), smooth);
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const Piece& a = pieces_[p];
    if (!has_fresh_[a.landmark[0]] && !has_fresh_[a.landmark[1]]) continue;
    for (std::size_t q = 0; q <= p; ++q) {
      const Piece& b = pieces_[q];
      if (!is_asked(a, b)) continue;
      const bool is_far = a.is_far_from(b);
      if (is_far && near.is_kelvin()) {
        const bool are_even = a.is_even && b.is_even;
        if (are_even != far_.are_even) add_taken(near);
        far_.are_even = are_even;
        take_far(a, b, rings, smooth);
        if (far_count_ == FarPairs::kCount) add_taken(near);
        continue;
      }
      add_taken(near);  // in order: the same bits however many are taken together
      if (is_far) {
        add_far(a, b, rings, near, smooth);
        continue;
      }
      for (std::uint32_t i = a.first; i < a.first + a.count; ++i)
        for (std::uint32_t j = b.first; j < (p == q ? i + 1 : b.first + b.count); ++j)
          add_pair(i, j, rings, near, smooth);
    }
  }
  add_taken(near);
  for (std::size_t m = 0; m < landmarks; ++m)
    for (std::size_t l = m; l < landmarks; ++l)
      K.block<3, 3>(3 * static_cast<Index>(l), 3 * static_cast<Index>(m)) += kept(l, m);
}

void NearMatrix::add(std::uint32_t l, std::uint32_t m, const Mat3& part) noexcept {
  if (is_fresh(l, m)) kept(l, m) += part;
}

// Adds a pair to those that are summed together.
void NearMatrix::take_far(const Piece& a, const Piece& b, const NeedleRings& rings,
                          const SmoothField* smooth) noexcept {
  const std::size_t lane = far_count_++;
  far_pieces_[lane] = {&a, &b};
  far_.s[lane] = rings.rings()[a.first].core.with(rings.rings()[b.first].core);
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t q = 0; q < 2; ++q) {
      const Vec3 apart = a.at[k] - b.at[q];
      far_.x[2 * k + q][lane] = apart.x();
      far_.y[2 * k + q][lane] = apart.y();
      far_.z[2 * k + q][lane] = apart.z();
    }
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t j = 0; j < 2; ++j) {
      const double weight = smooth ? smooth->near_factor(a.first, i, b.first, j) : 1;
      far_.weight[2 * i + j][lane] = weight;
      for (std::size_t k = 0; k < 2; ++k)
        for (std::size_t q = 0; q < 2; ++q)
          far_.even[2 * i + j][2 * k + q][lane] = weight * a.across[k][i] * b.across[q][j];
    }
  if (far_.are_even) return;
  const auto put = [&](const Mat3& share, FarPairs::Lanes* to) {
    for (Index k = 0; k < 9; ++k) to[k][lane] = share(k / 3, k % 3);
  };
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t side = 0; side < 2; ++side) {
      put(a.share(k, side), far_.share_a[k][side]);
      put(b.share(k, side), far_.share_b[k][side]);
    }
}

void NearMatrix::add_taken(const NearField& near) noexcept {
  if (far_count_ == 0) return;
  FarBlocks sums;
  far_pair_loop_(far_, near.kelvin_share(), near.scale(), sums);
  for (std::size_t lane = 0; lane < far_count_; ++lane) {
    const auto [a, b] = far_pieces_[lane];
    for (std::size_t i = 0; i < 2; ++i)
      for (std::size_t j = 0; j < 2; ++j) {
        const std::uint32_t l = a->landmark[i], m = b->landmark[j];
        const bool is_below = is_fresh(l, m), is_above = is_fresh(m, l);
        if (!is_below && !is_above) continue;
        Mat3 sum;
        for (Index k = 0; k < 9; ++k) sum(k / 3, k % 3) = sums.value[2 * i + j][k][lane];
        if (is_below) kept(l, m) += sum;
        if (is_above) kept(m, l) += sum.transpose();
      }
  }
  far_count_ = 0;
}

void NearMatrix::add_far(const Piece& a, const Piece& b, const NeedleRings& rings, const NearField& near,
                         const SmoothField* smooth) noexcept {
  const NeedleRings::Ring &from = rings.rings()[a.first], &to = rings.rings()[b.first];
  const double s_between = from.core.with(to.core);
  std::array<std::array<Mat3, 2>, 2> value;
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t q = 0; q < 2; ++q) value[k][q] = near.value(a.at[k] - b.at[q], s_between);
  for (std::size_t s = 0; s < 2; ++s)
    for (std::size_t t = 0; t < 2; ++t) {
      const std::uint32_t l = a.landmark[s], m = b.landmark[t];
      if (!is_fresh(l, m) && !is_fresh(m, l)) continue;
      const double weight = smooth ? smooth->near_factor(a.first, s, b.first, t) : 1;
      Mat3 sum = Mat3::Zero();
      for (std::size_t k = 0; k < 2; ++k)
        for (std::size_t q = 0; q < 2; ++q) {
          if (a.is_even && b.is_even)
            sum += (weight * a.across[k][s] * b.across[q][t]) * value[k][q];
          else
            sum += weight * a.share(k, s) * value[k][q] * b.share(q, t);
        }
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
      if (!is_fresh(l, m) && !is_fresh(m, l)) continue;
      const double weight = smooth ? smooth->near_factor(i, s, j, t) : 1;
      const Mat3 shared = a.is_even(s) && b.is_even(t) ? Mat3(weight * a.across[s] * b.across[t] * value)
                                                       : Mat3(weight * a.share(s) * value * b.share(t));
      add(l, m, shared);
      if (i != j) add(m, l, shared.transpose());
    }
}

}  // namespace brachy
