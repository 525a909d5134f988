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
      kLoss = 14,  ///< attenuation, as a share of soft tissue's
      kChannels = 16;
  float c[kChannels];
};

/// Where a node of the scan lies in the plane's grid: between four of its nodes, `first` and its neighbours.
struct GridPlace {
  std::uint32_t first = 0;
  float s = 0, t = 0;  ///< shares of the next column, and of the next row
};

/// How a scan is sampled: `kScatter` samples of scatterers, kScatterMm apart, from one node to the next. Where the
/// image's pixels are smaller, the pulse's kernel makes two samples of the scan of each.
struct ScanSteps {
  static constexpr std::size_t kScatter = 8, kMostPerScatter = 2;
  static constexpr float kScatterMm = 0.16F;
  static constexpr float kSegmentMm = kScatterMm * kScatter;
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

/// The pulse along a line: weights of scattered samples for the sample at the one in the middle, and, with two for each
/// scattered one, for the next sample.
struct AxialKernel {
  static constexpr std::size_t kMost = 64;
  std::size_t per_scatter = 1;      ///< 1 or 2
  std::size_t half = 0, count = 0;  ///< count = 2 × half + 2
  std::array<std::array<float, kMost>, ScanSteps::kMostPerScatter> weight{};
};

/// One pixel of scan conversion: bilinear between two samples of two lines. `first` past the scan's end: black.
struct PixelSource {
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::uint32_t first = kNone;  ///< line × samples + sample
  float along = 0, across = 0;  ///< shares of the next sample, and of the next line
};

struct Anatomy;
struct EchoPlaces;
struct EchoTissues;

/// The inner loops of the image, for one instruction set. Rows have a multiple of ScanSteps::kScatter samples.
/// Threads: any. Real-time: no allocation.
struct ScanLoops {
  /// Bilinear between the nodes of a grid with so many columns, all channels.
  void (*place)(const ScanNode* grid, std::size_t columns, const GridPlace* places, std::size_t count,
                ScanNode* nodes);
  /// `segments` of a line of scattered pressure before the point-spread function, complex: as many nodes and one more,
  /// one sample pair for each kScatterMm. `interface_scale`: of each segment, of what surfaces reflect; `layers`:
  /// of each sample, dB more.
  void (*scatter)(const ScanNode* nodes, std::size_t segments, const Speckle& speckle,
                  const float* interface_scale, const float* layers, float* re, float* im);
  /// From scattered samples to samples of the scan, for so many segments: out[per_scatter × i + p] = Σ_t kernel[p][t]
  /// in[i + t], t < kernel.count.
  void (*along)(const float* in, const AxialKernel& kernel, std::size_t segments, float* out);
  /// One segment of so many `samples` (8 or 16) of `groups` × kTogether lines, which are in_stride and out_stride
  /// floats apart. in: of line 0.
  void (*across)(const float* in, std::ptrdiff_t in_stride, const LateralKernel& kernel, std::size_t groups,
                 std::size_t samples, float* out, std::ptrdiff_t out_stride);
  /// The envelope's level in gray values: (10 log₁₀(|re + noise|² + …) + offset) × scale, within 0 … 255. noise[k]: the
  /// receiver's at each sample (amplitude); `key` makes it another one for each line and image.
  void (*detect)(const float* re, const float* im, const float* noise, std::uint32_t key, std::size_t count,
                 float offset_db, float gray_per_db, float* gray);
  /// What EchoMap says of so many places.
  void (*tissues)(const Anatomy& anatomy, const EchoPlaces& places, EchoTissues& tissues);
  /// pixels[i] from the rows of `gray`, rounded.
  void (*convert)(const float* gray, std::size_t samples, const PixelSource* sources, std::size_t count,
                  std::uint8_t* pixels);
};

/// The loops for `target`, which this processor must support.
const ScanLoops& scan_loops(SimdTarget target);

}  // namespace brachy
