#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/simd/simd_target.h"

namespace brachy {

/// What is known of a place in the scan, between whose nodes it is interpolated: 16 floats, one AVX-512 vector.
struct alignas(64) ScanNode {
  static constexpr std::size_t kX = 0,  ///< material point, mm: 3
      kByN = 3,                         ///< its change for each mm across the plane: 3
      kDistance = 6,                    ///< to the boundaries of EchoMap, mm: 5
      kOutside = 11, kTexture = 12,     ///< dB
      kGain = 13,  ///< of all that is between probe and here, and of the console's TGC, dB
      kChannels = 16;
  float c[kChannels];
};

/// How a scan is sampled: `kSegment` samples, kSampleMm apart, from one node to the next. Scatterers, which a cell
/// makes smooth, are sampled at every second; the pulse's kernel makes the others of them.
struct ScanSteps {
  static constexpr std::size_t kSegment = 16, kScatter = kSegment / 2;
  static constexpr float kSampleMm = 0.08F, kScatterMm = 2 * kSampleMm;
  static constexpr float kSegmentMm = kSampleMm * kSegment;
};

/// The scatterers: complex values at the nodes of a cubic grid in material coordinates, by a hash of the node.
struct Speckle {
  /// mm, between nodes. In the image two samples less than a cell apart are alike: lines lie closer than that.
  static constexpr float kCellMm = 0.25F;
  static constexpr std::size_t kMostPlanes = 5;
  std::uint32_t seed = 0;
  std::size_t planes = 1;
  std::array<float, kMostPlanes> offset_mm{}, weight{};  ///< across the plane
};

/// The beam across the lines of one segment: weights of lines for kTogether lines of the image at once. Where `step`
/// lines lie within a cell of the scatterers only each step-th has been made, and those between are taken as linear.
struct LateralKernel {
  static constexpr std::size_t kMostHalf = 40;  ///< lines
  static constexpr std::size_t kTogether = 4;
  static constexpr std::size_t kMostWeights = 2 * kMostHalf + kTogether + 4;
  std::size_t step = 1;      ///< 1, 2 or 4
  std::ptrdiff_t first = 0;  ///< line of the first weight, from the first of the kTogether
  std::size_t count = 0;
  std::array<std::array<float, kTogether>, kMostWeights> weight{};  ///< of line first + t · step, for each
};

/// The pulse along a line: weights of scattered samples for the sample at the one in the middle, and for the next
/// sample.
struct AxialKernel {
  static constexpr std::size_t kMost = 64;
  std::size_t half = 0, count = 0;  ///< count = 2 × half + 2
  std::array<std::array<float, kMost>, 2> weight{};
};

/// One pixel of scan conversion: bilinear between two samples of two lines. `first` past the scan's end: black.
struct PixelSource {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::uint32_t first = kNone;  ///< line × samples + sample
  float along = 0, across = 0;  ///< shares of the next sample, and of the next line
};

/// The inner loops of the image, for one instruction set. Rows have a multiple of ScanSteps::kSegment samples.
/// Threads: any. Real-time: no allocation.
struct ScanLoops {
  /// `segments` of a line of scattered pressure before the point-spread function, complex: as many nodes and one more,
  /// one sample pair for each kScatterMm. `interface_scale`: of each segment, of what surfaces reflect; `layers`:
  /// of each sample, dB more.
  void (*scatter)(const ScanNode* nodes, std::size_t segments, const Speckle& speckle,
                  const float* interface_scale, const float* layers, float* re, float* im);
  /// From samples kScatterMm apart to such kSampleMm apart, for so many segments: out[2 i + p] = Σ_t kernel[p][t]
  /// in[i + t], t < kernel.count.
  void (*along)(const float* in, const AxialKernel& kernel, std::size_t segments, float* out);
  /// One segment of `groups` × kTogether lines, which are in_stride and out_stride floats apart. in: of line 0.
  void (*across)(const float* in, std::ptrdiff_t in_stride, const LateralKernel& kernel, std::size_t groups,
                 float* out, std::ptrdiff_t out_stride);
  /// The envelope's level in gray values: (10 log₁₀(|re + noise|² + …) + offset) × scale, within 0 … 255. noise[k]: the
  /// receiver's at each sample (amplitude); `key` makes it another one for each line and image.
  void (*detect)(const float* re, const float* im, const float* noise, std::uint32_t key, std::size_t count,
                 float offset_db, float gray_per_db, float* gray);
  /// pixels[i] from the rows of `gray`, rounded.
  void (*convert)(const float* gray, std::size_t samples, const PixelSource* sources, std::size_t count,
                  std::uint8_t* pixels);
};

/// The loops for `target`, which this processor must support.
const ScanLoops& scan_loops(SimdTarget target);

}  // namespace brachy
