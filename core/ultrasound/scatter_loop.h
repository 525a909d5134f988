#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/simd/simd_attributes.h"
#include "core/ultrasound/echo_map.h"
#include "core/ultrasound/hashed_noise.h"
#include "core/ultrasound/scan_loops.h"

// Scattered pressure along one line; for scan_loops.cpp, which compiles it for each instruction set.
namespace brachy::scan {

constexpr int kLanes = static_cast<int>(ScanSteps::kScatter);  // of one segment
constexpr std::size_t kTogether = 4;                           // segments: registers of every target are full
constexpr int kBlock = kLanes * static_cast<int>(kTogether);
constexpr float kLog2PerDb = 0.166096404744F;  // of an amplitude: log2(10) / 20
constexpr float kEdgeMm = 0.3F;                // across which one tissue becomes another
constexpr float kZoneEdgeMm = 1.5F, kUrethraEdgeMm = 1.2F;
constexpr float kSurfaceMm = 0.2F;         // half the thickness of what a surface reflects from
constexpr float kWallMm = 0.75F;           // half the thickness of the urethral wall
constexpr float kOffGrid = 32768;          // keeps positions in cells positive
constexpr float kRootTwelve = 3.4641016F;  // a uniform value of width 1 has the deviation 1/√12

struct Block {
  alignas(64) float v[kBlock];
};

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

BRACHY_INLINE float share_inside(float distance, float edge) {
  return std::max(0.0F, std::min(1.0F, 0.5F - distance * (1 / edge)));
}

// Adds a node's complex value, 1 … 2 each: its hash's low and high 23 bits as mantissas. The bits that both have
// are the real part's first and the imaginary part's last.
BRACHY_INLINE void add_node(std::uint32_t key, float w, float& re, float& im) {
  const std::uint32_t h = hashed_quickly(key);
  const std::uint32_t low = (h & 0x7fffffU) | 0x3f800000U, high = (h >> 9) | 0x3f800000U;
  float a, b;
  std::memcpy(&a, &low, sizeof a);
  std::memcpy(&b, &high, sizeof b);
  re += w * a;
  im += w * b;
}

// 1/√s for ¼ ≤ s ≤ 1, within 9e-4: a polynomial through Chebyshev's points.
BRACHY_INLINE float inverse_root(float s) {
  const float d = s - 0.625F;
  float p = -5.5663829F;
  p = p * d + 3.8048984F;
  p = p * d - 1.4837590F;
  p = p * d + 1.1240445F;
  p = p * d - 1.0130054F;
  p = p * d + 1.2656290F;
  return p;
}

// Linear in the tetrahedron of four of a cell's corners that has the point (of six; K. Perlin, Improving noise, 2002,
// for the split), divided by the deviation of such a sum, so that it is the same everywhere.
BRACHY_INLINE void scatterers_at(float x, float y, float z, std::uint32_t seed, float& re, float& im) {
  const auto ix = static_cast<std::int32_t>(x), iy = static_cast<std::int32_t>(y),
             iz = static_cast<std::int32_t>(z);
  const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy),
              fz = z - static_cast<float>(iz);
  const std::uint32_t key = static_cast<std::uint32_t>(ix) * kNodeX +
                            static_cast<std::uint32_t>(iy) * kNodeY +
                            static_cast<std::uint32_t>(iz) * kNodeZ + seed;
  // From the cell's first corner to its last, along the axis of the largest fraction first.
  const float less = std::min(fx, fy), more = std::max(fx, fy);
  const float first = std::max(more, fz), last = std::min(less, fz),
              middle = std::max(less, std::min(more, fz));
  const std::uint32_t key_more = fx >= fy ? kNodeX : kNodeY, key_less = fx >= fy ? kNodeY : kNodeX;
  const std::uint32_t key_first = fz > more ? kNodeZ : key_more, key_last = fz <= less ? kNodeZ : key_less;
  const float w0 = 1 - first, w1 = first - middle, w2 = middle - last;
  re = im = -1.5F;  // the nodes' mean: their weights sum to 1
  add_node(key, w0, re, im);
  add_node(key + key_first, w1, re, im);
  add_node(key + (kNodeX + kNodeY + kNodeZ) - key_last, w2, re, im);
  add_node(key + (kNodeX + kNodeY + kNodeZ), last, re, im);
  const float norm = kRootTwelve * inverse_root(w0 * w0 + w1 * w1 + w2 * w2 + last * last);
  re *= norm;
  im *= norm;
}

/// A segment's nodes: a channel's value at sample k, and bounds of it over the segment, between whose ends it is
/// linear.
struct Segment {
  const float* a;
  float step[ScanNode::kChannels];

  BRACHY_INLINE float at(std::size_t c, float k) const { return a[c] + k * step[c]; }
  BRACHY_INLINE float last(std::size_t c) const { return a[c] + kLanes * step[c]; }
  BRACHY_INLINE float least(std::size_t c) const { return std::min(a[c], last(c)); }
  BRACHY_INLINE float most(std::size_t c) const { return std::max(a[c], last(c)); }
};

// GCC 12 mixes the channels of plain loops here.
using LaneFloats = float __attribute__((vector_size(4 * kLanes)));
constexpr LaneFloats kRamp = {0, 1, 2, 3, 4, 5, 6, 7};
static_assert(kLanes == 8);

// The slice's planes, summed, in up to kTogether segments.
BRACHY_INLINE void sum_scatterers(const ScanNode* nodes, std::size_t segments, const Speckle& speckle,
                                  Block& re, Block& im) {
  using N = ScanNode;
  constexpr float kPerCell = 1 / Speckle::kCellMm;
  Block place[6];  // X in cells, and by n
  for (std::size_t s = 0; s < segments; ++s)
    for (std::size_t c = 0; c < 6; ++c) {
      const float offset = c < 3 ? kOffGrid : 0, a = nodes[s].c[N::kX + c] * kPerCell + offset,
                  step = (nodes[s + 1].c[N::kX + c] - nodes[s].c[N::kX + c]) * (kPerCell / kLanes);
      const LaneFloats along = a + kRamp * step;
      std::memcpy(place[c].v + s * kLanes, &along, sizeof along);
    }
  for (std::size_t s = segments * kLanes; s < kBlock; ++s)
    for (Block& of : place) of.v[s] = kOffGrid;
  for (std::size_t p = 0; p < speckle.planes; ++p) {
    const float e = speckle.offset_mm[p], w = speckle.weight[p];
    const std::uint32_t seed = speckle.seed;
    const bool is_first = p == 0;
    for (int k = 0; k < kBlock; ++k) {
      float x, y;
      scatterers_at(place[0].v[k] + e * place[3].v[k], place[1].v[k] + e * place[4].v[k],
                    place[2].v[k] + e * place[5].v[k], seed, x, y);
      re.v[k] = w * x + (is_first ? 0 : re.v[k]);
      im.v[k] = w * y + (is_first ? 0 : im.v[k]);
    }
  }
}

// Levels of the tissue, dB. A boundary that is far from the whole segment changes nothing there, and is left out.
BRACHY_INLINE void add_levels(const Segment& s, float* db) {
  using E = EchoMap;
  constexpr std::size_t kDistance = ScanNode::kDistance;
  const auto blend = [](float& value, float distance, float edge, float level) {
    value += share_inside(distance, edge) * (level - value);
  };
  for (int k = 0; k < kLanes; ++k) db[k] = s.at(ScanNode::kOutside, static_cast<float>(k));
  if (s.least(kDistance + E::kGland) < 0.5F * kEdgeMm)
    for (int k = 0; k < kLanes; ++k) {
      const auto t = static_cast<float>(k);
      blend(db[k], s.at(kDistance + E::kGland, t), kEdgeMm, s.at(ScanNode::kTexture, t));
    }
  if (std::max(s.least(kDistance + E::kGland), s.least(kDistance + E::kTransition)) < 0.5F * kZoneEdgeMm)
    for (int k = 0; k < kLanes; ++k) {
      const auto t = static_cast<float>(k);
      blend(db[k], std::max(s.at(kDistance + E::kTransition, t), s.at(kDistance + E::kGland, t)), kZoneEdgeMm,
            s.at(ScanNode::kTexture, t) + E::kInside[E::kTransition].level_db);
    }
  if (s.least(kDistance + E::kUrethra) < 2 * kWallMm)
    for (int k = 0; k < kLanes; ++k) {
      const float urethra = s.at(kDistance + E::kUrethra, static_cast<float>(k));
      db[k] += E::kUrethralWallDb * std::max(0.0F, 1 - std::abs(urethra - kWallMm) * (1 / kWallMm));
      blend(db[k], urethra, kUrethraEdgeMm, E::kInside[E::kUrethra].level_db);
    }
  for (const std::size_t b : {E::kBladder, E::kBone})
    if (s.least(kDistance + b) < 0.5F * kEdgeMm)
      for (int k = 0; k < kLanes; ++k)
        blend(db[k], s.at(kDistance + b, static_cast<float>(k)), kEdgeMm, E::kInside[b].level_db);
}

// What surfaces reflect: square on, it falls with a power of the cosine between beam and normal, which is the
// distance's slope.
BRACHY_INLINE void add_surfaces(const Segment& s, const float* interface_scale, float* re) {
  for (const std::size_t b : {EchoMap::kGland, EchoMap::kUrethra, EchoMap::kBladder, EchoMap::kBone}) {
    const std::size_t c = ScanNode::kDistance + b;
    if (s.least(c) > kSurfaceMm || s.most(c) < -kSurfaceMm) continue;
    const float cosine = std::min(1.0F, std::abs(s.step[c]) * (1 / ScanSteps::kScatterMm));
    const float reflect = cosine * cosine * cosine * interface_scale[b];
    for (int k = 0; k < kLanes; ++k) {
      const auto t = static_cast<float>(k);
      re[k] += reflect * std::max(0.0F, 1 - std::abs(s.at(c, t)) * (1 / kSurfaceMm)) *
               power_of_two(s.at(ScanNode::kGain, t) * kLog2PerDb);
    }
  }
}

BRACHY_INLINE void scatter(const ScanNode* nodes, std::size_t segments, const Speckle& speckle,
                           const float* interface_scale, const float* layers, float* __restrict re,
                           float* __restrict im) {
  Block sum_re, sum_im, db;
  for (std::size_t first = 0; first < segments; first += kTogether) {
    const std::size_t together = std::min(kTogether, segments - first);
    sum_scatterers(nodes + first, together, speckle, sum_re, sum_im);
    Segment of[kTogether];
    for (std::size_t n = 0; n < together; ++n) {
      Segment& s = of[n];
      s.a = nodes[first + n].c;
      for (std::size_t c = 0; c < ScanNode::kChannels; ++c)
        s.step[c] = (nodes[first + n + 1].c[c] - s.a[c]) * (1.0F / kLanes);
      float* to = db.v + n * kLanes;
      add_levels(s, to);
      for (int k = 0; k < kLanes; ++k) to[k] += s.at(ScanNode::kGain, static_cast<float>(k));
    }
    const std::size_t at = first * kLanes;
    for (std::size_t k = 0; k < together * kLanes; ++k) {
      const float level = power_of_two((db.v[k] + layers[at + k]) * kLog2PerDb);
      re[at + k] = level * sum_re.v[k];
      im[at + k] = level * sum_im.v[k];
    }
    for (std::size_t n = 0; n < together; ++n)
      add_surfaces(of[n], interface_scale + (first + n) * EchoMap::kBoundaries, re + at + n * kLanes);
  }
}

}  // namespace brachy::scan
