// Compiled with -ffp-contract=fast: where a target has FMA, a·b + c is one instruction.
#include "core/ultrasound/scan_loops.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/simd/simd_attributes.h"
#include "core/ultrasound/echo_map.h"
#include "core/ultrasound/hashed_noise.h"

namespace brachy {
namespace {

constexpr int kLanesOfScan = static_cast<int>(ScanSteps::kSegment);
constexpr float kLog2PerDb = 0.166096404744F;  // of an amplitude: log2(10) / 20
constexpr float kDbPerLog2 = 3.01029995664F;   // of a power: 10 log10(2)
constexpr float kEdgeMm = 0.3F;                // across which one tissue becomes another
constexpr float kSurfaceMm = 0.2F;             // half the thickness of what a surface reflects from
constexpr float kWallMm = 0.75F;               // half the thickness of the urethral wall
constexpr float kOffGrid = 32768;              // keeps positions in cells positive
constexpr float kHashToUnit = 1.0F / 32768;    // of 16 bits, to −1 … 1
constexpr float kRootThree = 1.7320508F;       // a uniform value's deviation is 1/√3

// 2^x, |x| < 120, within 2e-6: x's whole part into the exponent, of the rest a polynomial (minimax, degree 5).
BRACHY_INLINE float power_of_two(float x) {
  x = std::max(-120.0F, std::min(120.0F, x));
  const float shifted = x + 12582912.0F;  // 1.5 × 2^23: rounds to a whole number
  const float whole = shifted - 12582912.0F, t = x - whole;
  float p = 1.3333558e-3F;
  p = p * t + 9.6181291e-3F;
  p = p * t + 5.5504109e-2F;
  p = p * t + 2.4022651e-1F;
  p = p * t + 6.9314718e-1F;
  p = p * t + 1.0F;
  const auto exponent = static_cast<std::int32_t>(whole);
  const std::int32_t bits = (exponent + 127) << 23;
  float scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return p * scale;
}

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

BRACHY_INLINE float share_inside(float distance, float edge) {
  return std::max(0.0F, std::min(1.0F, 0.5F - distance / edge));
}

// Adds a node's complex value: two 16-bit halves of its hash.
BRACHY_INLINE void add_node(std::uint32_t key, float w, float& re, float& im) {
  const std::uint32_t h = hashed(key);
  re += w * static_cast<float>(static_cast<std::int32_t>(h & 0xffffU) - 32768);
  im += w * static_cast<float>(static_cast<std::int32_t>(h >> 16) - 32768);
}

// Trilinear between eight nodes, divided by the deviation of such a sum, so that it is the same everywhere.
BRACHY_INLINE void scatterers_at(float x, float y, float z, std::uint32_t seed, float& re, float& im) {
  const auto ix = static_cast<std::int32_t>(x), iy = static_cast<std::int32_t>(y),
             iz = static_cast<std::int32_t>(z);
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy),
              fz = z - static_cast<float>(iz);
  const std::uint32_t key = static_cast<std::uint32_t>(ix) * kNodeX +
                            static_cast<std::uint32_t>(iy) * kNodeY +
                            static_cast<std::uint32_t>(iz) * kNodeZ + seed;
  const float gx = 1 - fx, gy = 1 - fy, gz = 1 - fz;
  const float w00 = gy * gz, w10 = fy * gz, w01 = gy * fz, w11 = fy * fz;
  re = im = 0;
  add_node(key, gx * w00, re, im);
  add_node(key + kNodeX, fx * w00, re, im);
  add_node(key + kNodeY, gx * w10, re, im);
  add_node(key + kNodeX + kNodeY, fx * w10, re, im);
  add_node(key + kNodeZ, gx * w01, re, im);
  add_node(key + kNodeX + kNodeZ, fx * w01, re, im);
  add_node(key + kNodeY + kNodeZ, gx * w11, re, im);
  add_node(key + kNodeX + kNodeY + kNodeZ, fx * w11, re, im);
  const float square = (fx * fx + gx * gx) * (fy * fy + gy * gy) * (fz * fz + gz * gz);
  const float norm = kHashToUnit * kRootThree / std::sqrt(square);
  re *= norm;
  im *= norm;
}

struct Lanes {
  alignas(64) float v[kLanesOfScan];
};

BRACHY_INLINE void scatter(const ScanNode* nodes, std::size_t segments, const Speckle& speckle,
                           const float* interface_scale, const float* layers, float* __restrict re,
                           float* __restrict im) {
  using N = ScanNode;
  constexpr float kPerCell = 1 / Speckle::kCellMm;
  for (std::size_t s = 0; s < segments; ++s) {
    const float* a = nodes[s].c;
    float step[N::kChannels];
    for (std::size_t c = 0; c < N::kChannels; ++c)
      step[c] = (nodes[s + 1].c[c] - a[c]) * (1.0F / kLanesOfScan);
    // What surfaces reflect square on falls with a power of the cosine between beam and normal: the distance's slope.
    float reflect[EchoMap::kBoundaries];
    for (std::size_t b = 0; b < EchoMap::kBoundaries; ++b) {
      const float cosine = std::min(1.0F, std::abs(step[N::kDistance + b]) * (1 / ScanSteps::kSampleMm));
      reflect[b] = cosine * cosine * cosine * interface_scale[s * EchoMap::kBoundaries + b];
    }
    Lanes sum_re{}, sum_im{}, level, surface;
    for (std::size_t p = 0; p < speckle.planes; ++p) {
      const float e = speckle.offset_mm[p], w = speckle.weight[p];
      float from[3], by[3];
      for (std::size_t k = 0; k < 3; ++k) {
        from[k] = (a[N::kX + k] + e * a[N::kByN + k]) * kPerCell + kOffGrid;
        by[k] = (step[N::kX + k] + e * step[N::kByN + k]) * kPerCell;
      }
      const std::uint32_t seed = speckle.seed;
      for (int k = 0; k < kLanesOfScan; ++k) {
        const auto t = static_cast<float>(k);
        float x, y;
        scatterers_at(from[0] + t * by[0], from[1] + t * by[1], from[2] + t * by[2], seed, x, y);
        sum_re.v[k] += w * x;
        sum_im.v[k] += w * y;
      }
    }
    for (int k = 0; k < kLanesOfScan; ++k) {
      const auto t = static_cast<float>(k);
      const auto at = [&](std::size_t c) { return a[c] + t * step[c]; };
      const float texture = at(N::kTexture), gain = at(N::kGain);
      const float gland = at(N::kDistance + EchoMap::kGland), zone = at(N::kDistance + EchoMap::kTransition),
                  urethra = at(N::kDistance + EchoMap::kUrethra),
                  bladder = at(N::kDistance + EchoMap::kBladder), bone = at(N::kDistance + EchoMap::kBone);
      float db = at(N::kOutside);
      db += share_inside(gland, kEdgeMm) * (texture - db);
      db += share_inside(std::max(zone, gland), 1.5F) *
            (texture + EchoMap::kInside[EchoMap::kTransition].level_db - db);
      db += EchoMap::kUrethralWallDb * std::max(0.0F, 1 - std::abs(urethra - kWallMm) * (1 / kWallMm));
      db += share_inside(urethra, 1.2F) * (EchoMap::kInside[EchoMap::kUrethra].level_db - db);
      db += share_inside(bladder, kEdgeMm) * (EchoMap::kInside[EchoMap::kBladder].level_db - db);
      db += share_inside(bone, kEdgeMm) * (EchoMap::kInside[EchoMap::kBone].level_db - db);
      level.v[k] = power_of_two((db + gain + layers[s * ScanSteps::kSegment + static_cast<std::size_t>(k)]) *
                                kLog2PerDb);
      const float through = power_of_two(gain * kLog2PerDb);
      const auto bell = [](float d) { return std::max(0.0F, 1 - std::abs(d) * (1 / kSurfaceMm)); };
      surface.v[k] =
          through * (reflect[EchoMap::kGland] * bell(gland) + reflect[EchoMap::kUrethra] * bell(urethra) +
                     reflect[EchoMap::kBladder] * bell(bladder) + reflect[EchoMap::kBone] * bell(bone));
    }
    for (int k = 0; k < kLanesOfScan; ++k) {
      re[s * ScanSteps::kSegment + static_cast<std::size_t>(k)] = level.v[k] * sum_re.v[k] + surface.v[k];
      im[s * ScanSteps::kSegment + static_cast<std::size_t>(k)] = level.v[k] * sum_im.v[k];
    }
  }
}

BRACHY_INLINE void convolve(const float* __restrict in, std::ptrdiff_t stride, const float* __restrict kernel,
                            std::size_t count, float* __restrict out) {
  Lanes sum{};
  for (std::size_t t = 0; t < count; ++t) {
    const float w = kernel[t];
    const float* from = in + static_cast<std::ptrdiff_t>(t) * stride;
    for (int k = 0; k < kLanesOfScan; ++k) sum.v[k] += w * from[k];
  }
  std::memcpy(out, sum.v, sizeof sum.v);
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
#define BRACHY_TARGET(name, attribute)                                                                     \
  struct name {                                                                                            \
    attribute static void run_scatter(const ScanNode* nodes, std::size_t segments, const Speckle& speckle, \
                                      const float* interface_scale, const float* layers, float* re,        \
                                      float* im) {                                                         \
      scatter(nodes, segments, speckle, interface_scale, layers, re, im);                                  \
    }                                                                                                      \
    attribute static void run_convolve(const float* in, std::ptrdiff_t stride, const float* kernel,        \
                                       std::size_t count, float* out) {                                    \
      convolve(in, stride, kernel, count, out);                                                            \
    }                                                                                                      \
    attribute static void run_detect(const float* re, const float* im, const float* noise,                 \
                                     std::uint32_t key, std::size_t count, float offset_db,                \
                                     float gray_per_db, float* gray) {                                     \
      detect(re, im, noise, key, count, offset_db, gray_per_db, gray);                                     \
    }                                                                                                      \
    attribute static void run_convert(const float* gray, std::size_t samples, const PixelSource* sources,  \
                                      std::size_t count, std::uint8_t* pixels) {                           \
      convert(gray, samples, sources, count, pixels);                                                      \
    }                                                                                                      \
    static constexpr ScanLoops kLoops{run_scatter, run_convolve, run_detect, run_convert};                 \
  }
// NOLINTEND(bugprone-macro-parentheses)

BRACHY_TARGET(GenericScan, );
BRACHY_TARGET(Sse4Scan, BRACHY_SSE4);
BRACHY_TARGET(Avx2Scan, BRACHY_AVX2);
BRACHY_TARGET(Avx512Scan, BRACHY_AVX512);

}  // namespace

const ScanLoops& scan_loops(SimdTarget target) {
  return loops_for(target, GenericScan::kLoops, Sse4Scan::kLoops, Avx2Scan::kLoops, Avx512Scan::kLoops);
}

}  // namespace brachy
