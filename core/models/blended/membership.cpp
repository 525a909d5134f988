#include "core/models/blended/membership.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace brachy {
namespace {

// What a region takes and leaves, and dθ/d distance.
struct Blend {
  double taken, left, slope;
};

Blend blend_at(double distance, double blend_mm) {
  const double t = 0.5 - distance / blend_mm;
  if (!(t > 0)) return {0, 1, 0};
  if (t >= 1) return {1, 0, 0};
  const double S = std::min(1.0, t * t * t * (10 + t * (-15 + 6 * t)));
  const double angle = 0.5 * std::numbers::pi * S, slope = 15 * std::numbers::pi * t * t * (1 - t) * (1 - t);
  return {std::sin(angle), std::cos(angle), -slope / blend_mm};
}

// sin(πx/2) for 0 ≤ x ≤ 1, within 1e-7: Taylor's series.
inline float quarter_sine(float x) {
  const float a = static_cast<float>(0.5 * std::numbers::pi) * x, b = a * a;
  return a *
         (1 + b * (-1.0f / 6 + b * (1.0f / 120 + b * (-1.0f / 5040 + b * (1.0f / 362880 - b / 39916800)))));
}

// How large the derivatives of what a blend takes and leaves are, by t.
class BlendBounds {
 public:
  static constexpr std::size_t kBins = 32;
  using At = std::array<double, 4>;  // of the value, d/dt, d²/dt², d³/dt³

  BlendBounds() {
    constexpr int kSamples = 16;  // of a bin
    constexpr double kBetweenSamples = 1.02;
    for (std::size_t bin = 0; bin < kBins; ++bin)
      for (int i = 0; i <= kSamples; ++i) {
        const double t = (static_cast<double>(bin) + static_cast<double>(i) / kSamples) / kBins, u = 1 - t;
        constexpr double kQuarter = 0.5 * std::numbers::pi;  // turn
        const double angle = kQuarter * t * t * t * (10 + t * (-15 + 6 * t)),
                     d1 = 30 * kQuarter * t * t * u * u, d2 = 60 * kQuarter * t * u * (1 - 2 * t),
                     d3 = 60 * kQuarter * (1 + t * (-6 + 6 * t));
        const double s = std::sin(angle), c = std::cos(angle);
        const auto raise = [&](At& at, double value, double slope) {  // value″ = −value
          const At here = {std::abs(value), std::abs(slope * d1), std::abs(slope * d2 - value * d1 * d1),
                           std::abs(slope * d3 - 3 * value * d1 * d2 - slope * d1 * d1 * d1)};
          for (std::size_t j = 0; j < 4; ++j)
            at[j] = std::max(at[j], (j > 0 ? kBetweenSamples : 1) * here[j]);
        };
        raise(taken_[bin], s, c);
        raise(left_[bin], c, -s);
      }
  }
  static const BlendBounds& get() {
    static const BlendBounds bounds;
    return bounds;
  }
  // Over t in [least, most], 0 < most, least < 1.
  void over(double least, double most, At& taken, At& left) const {
    const auto bin = [](double t) {
      return static_cast<std::size_t>(std::clamp(t * kBins, 0.0, static_cast<double>(kBins - 1)));
    };
    taken = left = {};
    for (std::size_t b = bin(least); b <= bin(most); ++b)
      for (std::size_t j = 0; j < 4; ++j) {
        taken[j] = std::max(taken[j], taken_[b][j]);
        left[j] = std::max(left[j], left_[b][j]);
      }
  }

 private:
  std::array<At, kBins> taken_{}, left_{};
};

using ShareBounds = Membership::ShareBounds;

// f(t(X)) with t = ½ − distance/blend, by the chain rule; Σ_k |∂_k² d| ≤ 3 |D²d| and Σ_k |∂_k d| |∇∂_k d| ≤
// √3 |∇d| |D²d|.
ShareBounds composed(const BlendBounds::At& f, const std::array<double, 3>& slope, double blend_mm) {
  constexpr double kRoot3 = std::numbers::sqrt3;
  const double a = slope[0] / blend_mm, b = slope[1] / blend_mm, c = slope[2] / blend_mm;
  return {f[0], f[1] * a, f[2] * a * a + kRoot3 * f[1] * b, f[2] * a * a + 3 * f[1] * b,
          f[3] * a * a * a + (3 + 2 * kRoot3) * f[2] * a * b + 3 * f[1] * c};
}

ShareBounds product(const ShareBounds& f, const ShareBounds& g) {
  return {f.value * g.value, f.slope * g.value + f.value * g.slope,
          f.bend * g.value + 2 * f.slope * g.slope + f.value * g.bend,
          f.bends * g.value + 2 * f.slope * g.slope + f.value * g.bends,
          f.third * g.value + (f.bends + 2 * f.bend) * g.slope + f.slope * (g.bends + 2 * g.bend) +
              f.value * g.third};
}

}  // namespace

Membership::Membership(std::vector<Part> parts, std::size_t tissues)
    : parts_(std::move(parts)), tissues_(tissues) {
  BlendBounds::get();  // made here, not in a tick
  assert(tissues > 0 && tissues <= kMaxTissues);
  for ([[maybe_unused]] const Part& part : parts_)
    assert(part.region && part.blend_mm > 0 && part.tissue < tissues);
}

void Membership::shares(const Vec3& X, std::span<double> w) const noexcept {
  assert(w.size() == tissues_);
  std::ranges::fill(w, 0.0);
  double left = 1;
  for (std::size_t p = parts_.size(); p > 0 && left > 0; --p) {
    const Part& part = parts_[p - 1];
    const Blend blend = blend_at(part.region->at(X), part.blend_mm);
    const double share = left * blend.taken;
    w[part.tissue] += share * share;
    left *= blend.left;
  }
  w[0] += left * left;
  for (double& v : w) v = std::sqrt(v);
}

void Membership::shares(const Vec3& X, std::span<double> w, std::span<Vec3> gradients) const noexcept {
  assert(w.size() == tissues_ && gradients.size() == tissues_);
  std::ranges::fill(w, 0.0);
  std::ranges::fill(gradients, Vec3::Zero());
  double left = 1;
  Vec3 left_gradient = Vec3::Zero();
  // Until the end w and gradients hold Σ share² and half its gradient.
  const auto add = [&](std::size_t tissue, double share, const Vec3& gradient) {
    w[tissue] += share * share;
    gradients[tissue] += share * gradient;
  };
  for (std::size_t p = parts_.size(); p > 0 && left > 0; --p) {
    const Part& part = parts_[p - 1];
    Vec3 normal;
    const Blend blend = blend_at(part.region->at(X, &normal), part.blend_mm);
    const Vec3 turn = left * blend.slope * normal;
    add(part.tissue, left * blend.taken, blend.taken * left_gradient + blend.left * turn);
    left_gradient = blend.left * left_gradient - blend.taken * turn;
    left *= blend.left;
  }
  add(0, left, left_gradient);
  for (std::size_t m = 0; m < tissues_; ++m) {
    w[m] = std::sqrt(w[m]);
    gradients[m] = w[m] > 0 ? Vec3(gradients[m] / w[m]) : Vec3(Vec3::Zero());
  }
}

void Membership::shares(const Vec3& centre, double radius, const CellPoints& X,
                        std::span<CellShares> shares) const noexcept {
  constexpr std::size_t kCount = CellPoints::kCount;
  assert(shares.size() == tissues_);
  for (CellShares& of : shares) of = {};
  alignas(64) float left[kCount], left_gradient[3][kCount] = {};
  std::fill_n(left, kCount, 1.0f);
  // As for one point: until the end Σ share² and half its gradient.
  const auto add = [&](CellShares& of, const float* share, const float(*gradient)[kCount]) {
    for (std::size_t n = 0; n < kCount; ++n) {
      of.w[n] += share[n] * share[n];
      for (std::size_t k = 0; k < 3; ++k) of.g[k][n] += share[n] * gradient[k][n];
    }
  };
  for (std::size_t p = parts_.size(); p > 0; --p) {
    const Part& part = parts_[p - 1];
    if (0.5 - part.region->over(centre, radius).least / part.blend_mm <= 0) continue;
    CellDistances distances;
    part.region->at(centre, X, distances);
    const auto inverse = static_cast<float>(1 / part.blend_mm);
    alignas(64) float share[kCount], gradient[3][kCount];
    for (std::size_t n = 0; n < kCount; ++n) {
      const float t = std::clamp(0.5f - distances.d[n] * inverse, 0.0f, 1.0f), u = 1 - t;
      const float S = t * t * t * (10 + t * (-15 + 6 * t));
      const float taken = quarter_sine(S), kept = quarter_sine(1 - S);
      const float turn = -15 * std::numbers::pi_v<float> * t * t * u * u * inverse * left[n];
      share[n] = left[n] * taken;
      for (std::size_t k = 0; k < 3; ++k) {
        const float along = turn * distances.g[k][n], before = left_gradient[k][n];
        gradient[k][n] = taken * before + kept * along;
        left_gradient[k][n] = kept * before - taken * along;
      }
      left[n] *= kept;
    }
    add(shares[part.tissue], share, gradient);
  }
  add(shares[0], left, left_gradient);
  for (CellShares& of : shares)
    for (std::size_t n = 0; n < kCount; ++n) {
      of.w[n] = std::sqrt(of.w[n]);
      const float inverse = 1 / std::max(of.w[n], 1e-18f);
      for (std::size_t k = 0; k < 3; ++k) of.g[k][n] *= inverse;
    }
}

std::size_t Membership::work() const {
  std::size_t sum = 10;
  for (const Part& part : parts_) sum += part.region->work();
  return sum;
}

void Membership::bound(const Vec3& X, double radius, std::span<ShareBounds> bounds) const noexcept {
  assert(bounds.size() == tissues_);
  std::ranges::fill(bounds, ShareBounds{});
  const auto add = [&](std::size_t tissue, const ShareBounds& share) {
    ShareBounds& w = bounds[tissue];
    if (w.value == 0)
      w = share;
    else  // |∇√Σw²|² ≤ Σ|∇w|²; no more follows from the root
      w = {std::hypot(w.value, share.value), std::hypot(w.slope, share.slope), kHuge, kHuge, kHuge};
  };
  ShareBounds left = {1, 0, 0, 0, 0};
  for (std::size_t p = parts_.size(); p > 0 && left.value > 0; --p) {
    const Part& part = parts_[p - 1];
    const DistanceBounds distance = part.region->over(X, radius);
    const double least = 0.5 - distance.most / part.blend_mm, most = 0.5 - distance.least / part.blend_mm;
    if (!(most > 0)) continue;
    if (least >= 1) {
      add(part.tissue, left);
      left = {};
      break;
    }
    BlendBounds::At taken, kept;
    BlendBounds::get().over(least, most, taken, kept);
    add(part.tissue, product(left, composed(taken, distance.slope, part.blend_mm)));
    left = product(left, composed(kept, distance.slope, part.blend_mm));
  }
  if (left.value > 0) add(0, left);
  const auto has_share = [](const ShareBounds& w) { return w.value > 0; };
  if (std::ranges::count_if(bounds, has_share) == 1)
    *std::ranges::find_if(bounds, has_share) = {1, 0, 0, 0, 0};
  for (ShareBounds& w : bounds) w.value = std::min(w.value, 1.0);
}

}  // namespace brachy
