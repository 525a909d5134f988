// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/ultrasound/scan_loops.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/simd/simd_attributes.h"
#include "core/ultrasound/hashed_noise.h"
#include "core/ultrasound/scatter_loop.h"
#include "core/ultrasound/tissue_loop.h"

namespace brachy {
namespace {

constexpr float kDbPerLog2 = 3.01029995664F;  // of a power: 10 log10(2)
constexpr float kHashToUnit = 1.0F / 32768;   // of 16 bits, to −1 … 1

// log2 of a positive normal number, within 2e-5 (least squares at Chebyshev's points).
BRACHY_INLINE float log_two(float x) {
  std::int32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  const float exponent = static_cast<float>((bits >> 23) - 127);
  bits = (bits & 0x7fffff) | 0x3f800000;
  float m;
  std::memcpy(&m, &bits, sizeof m);
  float p = 0.04392957F;
  p = p * m - 0.40948426F;
  p = p * m + 1.61020813F;
  p = p * m - 3.52027091F;
  p = p * m + 5.06979932F;
  p = p * m - 2.79416749F;
  return exponent + p;
}

// One register of a target, written out: GCC 12 keeps sums of plain loops in memory.
template <std::size_t kWidth>
struct ScanRegister;
template <>
struct ScanRegister<2> {  // never used: what is half of the least width
  using Floats = float __attribute__((vector_size(8)));
};
template <>
struct ScanRegister<4> {
  using Floats = float __attribute__((vector_size(16)));
};
template <>
struct ScanRegister<8> {
  using Floats = float __attribute__((vector_size(32)));
};
template <>
struct ScanRegister<16> {
  using Floats = float __attribute__((vector_size(64)));
};
template <class R>
BRACHY_INLINE void add_product(float weight, const float* from, R& sum) {
  R in;
  std::memcpy(&in, from, sizeof in);
  sum += weight * in;
}

template <std::size_t kWidth>
BRACHY_INLINE void place(const ScanNode* grid, std::size_t columns, const GridPlace* places,
                         std::size_t count, ScanNode* nodes) {
  using R = typename ScanRegister<kWidth>::Floats;
  for (std::size_t i = 0; i < count; ++i) {
    const GridPlace& p = places[i];
    const ScanNode* from = grid + p.first;
    const float weight[4] = {(1 - p.s) * (1 - p.t), p.s * (1 - p.t), (1 - p.s) * p.t, p.s * p.t};
    for (std::size_t k = 0; k < ScanNode::kChannels; k += kWidth) {
      R sum{};
      add_product(weight[0], from[0].c + k, sum);
      add_product(weight[1], from[1].c + k, sum);
      add_product(weight[2], from[columns].c + k, sum);
      add_product(weight[3], from[columns + 1].c + k, sum);
      std::memcpy(nodes[i].c + k, &sum, sizeof sum);
    }
  }
}

template <std::size_t kWidth>
BRACHY_INLINE void along(const float* __restrict in, const AxialKernel& kernel, std::size_t segments,
                         float* __restrict out) {
  constexpr std::size_t kScatter = ScanSteps::kScatter, kRegisters = kScatter / kWidth;
  using R = typename ScanRegister<kWidth>::Floats;
  for (std::size_t s = 0; s < segments; ++s) {
    R even[kRegisters] = {}, odd[kRegisters] = {};
    const float* from = in + s * kScatter;
    if (kernel.per_scatter == 1) {
      for (std::size_t t = 0; t < kernel.count; ++t)
        for (std::size_t k = 0; k < kRegisters; ++k)
          add_product(kernel.weight[0][t], from + t + kWidth * k, even[k]);
      std::memcpy(out + s * kScatter, even, sizeof even);
      continue;
    }
    for (std::size_t t = 0; t < kernel.count; ++t)
      for (std::size_t k = 0; k < kRegisters; ++k) {
        add_product(kernel.weight[0][t], from + t + kWidth * k, even[k]);
        add_product(kernel.weight[1][t], from + t + kWidth * k, odd[k]);
      }
    float* to = out + 2 * s * kScatter;
    for (std::size_t k = 0; k < kScatter; ++k) {
      to[2 * k] = even[k / kWidth][k % kWidth];
      to[2 * k + 1] = odd[k / kWidth][k % kWidth];
    }
  }
}

// Each line that is read serves four.
template <std::size_t kWidth>
BRACHY_INLINE void across(const float* __restrict in, std::ptrdiff_t in_stride, const LateralKernel& kernel,
                          std::size_t groups, std::size_t samples, float* __restrict out,
                          std::ptrdiff_t out_stride) {
  using R = typename ScanRegister<kWidth>::Floats;
  constexpr auto kTogether = static_cast<std::ptrdiff_t>(LateralKernel::kTogether);
  const std::ptrdiff_t step = static_cast<std::ptrdiff_t>(kernel.step) * in_stride;
  for (std::size_t g = 0; g < groups; ++g)
    for (std::size_t k = 0; k < samples; k += kWidth) {
      const float* from = in + (static_cast<std::ptrdiff_t>(g) * kTogether + kernel.first) * in_stride + k;
      R a{}, b{}, c{}, d{};
      for (std::size_t t = 0; t < kernel.count; ++t, from += step) {
        const auto& w = kernel.weight[t];
        R line;
        std::memcpy(&line, from, sizeof line);
        a += w[0] * line;
        b += w[1] * line;
        c += w[2] * line;
        d += w[3] * line;
      }
      float* to = out + static_cast<std::ptrdiff_t>(g) * kTogether * out_stride + k;
      std::memcpy(to, &a, sizeof a);
      std::memcpy(to + out_stride, &b, sizeof b);
      std::memcpy(to + 2 * out_stride, &c, sizeof c);
      std::memcpy(to + 3 * out_stride, &d, sizeof d);
    }
}

BRACHY_INLINE void detect(const float* __restrict re, const float* __restrict im,
                          const float* __restrict noise, std::uint32_t key, std::size_t count,
                          float offset_db, float gray_per_db, float* __restrict gray) {
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t h = hashed(key + static_cast<std::uint32_t>(i));
    const float n = noise[i] * kHashToUnit;
    const float x = re[i] + n * static_cast<float>(static_cast<std::int32_t>(h & 0xffffU) - 32768);
    const float y = im[i] + n * static_cast<float>(static_cast<std::int32_t>(h >> 16) - 32768);
    const float db = kDbPerLog2 * log_two(x * x + y * y + 1e-20F);
    gray[i] = std::max(0.0F, std::min(255.0F, (db + offset_db) * gray_per_db));
  }
}

BRACHY_INLINE void convert(const float* __restrict gray, std::size_t samples,
                           const PixelSource* __restrict sources, std::size_t count,
                           std::uint8_t* __restrict pixels) {
  for (std::size_t i = 0; i < count; ++i) {
    const PixelSource& source = sources[i];
    if (source.first == PixelSource::kNone) {
      pixels[i] = 0;
      continue;
    }
    const float* near = gray + source.first;
    const float* next = near + samples;
    const float a = near[0] + source.along * (near[1] - near[0]);
    const float b = next[0] + source.along * (next[1] - next[0]);
    pixels[i] = static_cast<std::uint8_t>(a + source.across * (b - a) + 0.5F);
  }
}

// NOLINTBEGIN(bugprone-macro-parentheses): an attribute cannot stand in parentheses.
#define BRACHY_TARGET(name, attribute, width)                                                                \
  struct name {                                                                                              \
    attribute static void run_place(const ScanNode* grid, std::size_t columns, const GridPlace* places,      \
                                    std::size_t count, ScanNode* nodes) {                                    \
      place<width>(grid, columns, places, count, nodes);                                                     \
    }                                                                                                        \
    attribute static void run_scatter(const ScanNode* nodes, std::size_t segments, const Speckle& speckle,   \
                                      const float* interface_scale, const float* layers, float* re,          \
                                      float* im) {                                                           \
      scan::scatter(nodes, segments, speckle, interface_scale, layers, re, im);                              \
    }                                                                                                        \
    attribute static void run_along(const float* in, const AxialKernel& kernel, std::size_t segments,        \
                                    float* out) {                                                            \
      along<std::min(width, 8)>(in, kernel, segments, out);                                                  \
    }                                                                                                        \
    attribute static void run_across(const float* in, std::ptrdiff_t in_stride, const LateralKernel& kernel, \
                                     std::size_t groups, std::size_t samples, float* out,                    \
                                     std::ptrdiff_t out_stride) {                                            \
      if (samples % width == 0)                                                                              \
        across<width>(in, in_stride, kernel, groups, samples, out, out_stride);                              \
      else                                                                                                   \
        across<width / 2>(in, in_stride, kernel, groups, samples, out, out_stride);                          \
    }                                                                                                        \
    attribute static void run_tissues(const Anatomy& anatomy, const EchoPlaces& places, EchoTissues& out) {  \
      scan::find_tissues(anatomy, places, out);                                                              \
    }                                                                                                        \
    attribute static void run_detect(const float* re, const float* im, const float* noise,                   \
                                     std::uint32_t key, std::size_t count, float offset_db,                  \
                                     float gray_per_db, float* gray) {                                       \
      detect(re, im, noise, key, count, offset_db, gray_per_db, gray);                                       \
    }                                                                                                        \
    attribute static void run_convert(const float* gray, std::size_t samples, const PixelSource* sources,    \
                                      std::size_t count, std::uint8_t* pixels) {                             \
      convert(gray, samples, sources, count, pixels);                                                        \
    }                                                                                                        \
    static constexpr ScanLoops kLoops{run_place,  run_scatter, run_along,  run_across,                       \
                                      run_detect, run_tissues, run_convert};                                 \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(GenericScan, , 4);
BRACHY_TARGET(Sse4Scan, BRACHY_SSE4, 4);
BRACHY_TARGET(Avx2Scan, BRACHY_AVX2, 8);
BRACHY_TARGET(Avx512Scan, BRACHY_AVX512, 16);

}  // namespace

const ScanLoops& scan_loops(SimdTarget target) {
  return loops_for(target, GenericScan::kLoops, Sse4Scan::kLoops, Avx2Scan::kLoops, Avx512Scan::kLoops);
}

}  // namespace brachy
