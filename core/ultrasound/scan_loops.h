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

/// How a scan is sampled: `kSegment` samples, kSampleMm apart, from one node to the next.
struct ScanSteps {
  static constexpr std::size_t kSegment = 16;
  static constexpr float kSampleMm = 0.08F;
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

/// Gaussian kernels of the lines of one segment: 2 × half + 1 weights.
struct LateralKernel {
  static constexpr std::size_t kMostHalf = 40;
  std::size_t half = 0;
  std::array<float, 2 * kMostHalf + 1> weight{};
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
  /// One line of scattered pressure before the point-spread function, complex: `segments` + 1 nodes, one sample pair
  /// for each kSampleMm. `interface_scale`: of each segment, of what surfaces
  /// reflect; `layers`: of each sample, dB more.
  void (*scatter)(const ScanNode* nodes, std::size_t segments, const Speckle& speckle,
                  const float* interface_scale, const float* layers, float* re, float* im);
  /// out[i] = Σ_t kernel[t] in[i + t stride], i < ScanSteps::kSegment, t < count: along a line with stride 1, across
  /// lines with the distance from one to the next.
  void (*convolve)(const float* in, std::ptrdiff_t stride, const float* kernel, std::size_t count,
                   float* out);
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
