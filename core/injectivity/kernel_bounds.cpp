#include "core/injectivity/kernel_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brachy {
namespace {

constexpr int kSamples = 64;  // of a bin
// more than these functions grow between two samples, from the second bin on
constexpr double kBetweenSamples = 1.01;
constexpr double kNearZero = 1e-9;

// With h = ψ′/r and c the cosine between v and x, ψ as a function of |x|²/2 gives
//   D³ψ[v, v, v] = (r h″ − h′) c³ + 3 h′ c
// whose extrema over 0 ≤ c ≤ 1 are at 1 or where the derivative vanishes.
template <class K>
double third_derivative(double r) {
  const auto [h1, h2] = K::over_r_derivatives(r);
  const auto at = [first = h1, cubic = r * h2 - h1](double c) {
    return std::abs(cubic * c * c * c + 3 * first * c);
  };
  const double c2 = h1 / (h1 - r * h2);
  return std::max(at(1), c2 > 0 && c2 < 1 ? at(std::sqrt(c2)) : 0.0);
}

}  // namespace

KernelBounds::KernelBounds(const Kernel& kernel) {
  std::visit(
      [&]<class K>(K) {
        for (std::size_t k = kBins; k-- > 0;) {
          slope_[k] = slope_[k + 1];
          third_[k] = third_[k + 1];
          for (int i = 0; i <= kSamples; ++i) {
            const double r = std::clamp((static_cast<double>(k) + static_cast<double>(i) / kSamples) / kBins,
                                        kNearZero, 1 - kNearZero);
            slope_[k] = std::max(slope_[k], kBetweenSamples * std::abs(K::derivative(r)));
            third_[k] = std::max(third_[k], kBetweenSamples * third_derivative<K>(r));
          }
          slope_[k] = std::min(slope_[k], K::kMaxSlope);
        }
        slope_[0] = K::kMaxSlope;
        kink_ = std::abs(K::over_r_derivatives(1)[0]);  // ψ″ = h + r h′, and h(1) = 0
        if (third_derivative<K>(kNearZero) > 1e6) third_[0] = std::numeric_limits<double>::infinity();
      },
      kernel);
}

}  // namespace brachy
