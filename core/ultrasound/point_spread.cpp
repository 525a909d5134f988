#include "core/ultrasound/point_spread.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/ultrasound/echo_map.h"
#include "core/ultrasound/hashed_noise.h"

namespace brachy {
namespace {

constexpr double kSpeedMmPerUs = 1.54;
constexpr double kLeastFNumber = 2;
constexpr double kSigmaOfWidth = 1 / 2.3548200450309493;  // of a Gaussian's full width at half maximum
constexpr double kCut = 2.6;                              // deviations at which kernels end
constexpr double kNarrowest = 0.5;                        // samples: deviation of the narrowest kernel
constexpr double kCellVariance = double{Speckle::kCellMm} * double{Speckle::kCellMm} / 6;

double deviation_beside_cell(double width_mm, double sample_mm) {
  const double sigma = width_mm * kSigmaOfWidth;
  return std::sqrt(std::max(sigma * sigma - kCellVariance, kNarrowest * kNarrowest * sample_mm * sample_mm));
}

double decibel(double db) {
  return std::pow(10, 0.05 * db);
}

// Mean square of a weighted sum of scatterers at these distances, whose correlation is a Gaussian of twice the cell's
// variance.
template <class Weight, class Place>
double mean_square(std::size_t count, const Weight& weight, const Place& place) {
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < count; ++j) {
      const double d = place(i) - place(j);
      sum += weight(i) * weight(j) * std::exp(-d * d / (4 * kCellVariance));
    }
  return sum;
}

}  // namespace

Speckle speckle_of(const UltrasoundSettings& settings) {
  Speckle speckle;
  speckle.seed = hashed(static_cast<std::uint32_t>(settings.seed) ^
                        hashed(static_cast<std::uint32_t>(settings.seed >> 32) + 7));
  speckle.planes = static_cast<std::size_t>(std::clamp(settings.planes, 1, 5));
  const double sigma = settings.elevation_mm * kSigmaOfWidth;
  // Over ±1 deviation with three, ±1.5 with five.
  const double step = speckle.planes == 3 ? sigma : 0.75 * sigma;
  for (std::size_t p = 0; p < speckle.planes; ++p) {
    const double e = step * (static_cast<double>(p) - 0.5 * static_cast<double>(speckle.planes - 1));
    speckle.offset_mm[p] = static_cast<float>(e);
    speckle.weight[p] = static_cast<float>(std::exp(-e * e / (2 * sigma * sigma)));
  }
  return speckle;
}

PointSpread::PointSpread(const UltrasoundSettings& settings, const ImagePlane& plane, const Speckle& speckle,
                         std::size_t segments)
    : wavelength_(kSpeedMmPerUs / settings.frequency_mhz),
      aperture_(settings.aperture_mm),
      focus_(settings.focus_mm),
      axial_mm_(0.5 * settings.pulse_cycles * wavelength_),
      elevation_sigma_(settings.elevation_mm * kSigmaOfWidth) {
  const double sample = ScanSteps::kSampleMm, sigma = deviation_beside_cell(axial_mm_, sample);
  axial_mm_ = std::sqrt(sigma * sigma + kCellVariance) / kSigmaOfWidth;
  axial_half_ = static_cast<std::size_t>(std::ceil(kCut * sigma / sample));
  std::vector<double> taps;
  for (std::size_t k = 0; k <= 2 * axial_half_; ++k) {
    const double z = sample * (static_cast<double>(k) - static_cast<double>(axial_half_));
    taps.push_back(std::exp(-z * z / (2 * sigma * sigma)));
  }
  const double axial_square = mean_square(
      taps.size(), [&](std::size_t k) { return taps[k]; },
      [&](std::size_t k) { return sample * static_cast<double>(k); });
  const double across_square = mean_square(
      speckle.planes, [&](std::size_t p) { return double{speckle.weight[p]}; },
      [&](std::size_t p) { return double{speckle.offset_mm[p]}; });
  const double scale = 1 / std::sqrt(2 * axial_square * across_square);  // 2: both parts of a complex value
  double bell = 0;  // what a surface 0.4 mm thick becomes (scan_loops.cpp)
  for (std::size_t k = 0; k < taps.size(); ++k) {
    taps[k] *= scale;
    axial_.push_back(static_cast<float>(taps[k]));
    const double z = sample * std::abs(static_cast<double>(k) - static_cast<double>(axial_half_));
    bell += taps[k] * std::max(0.0, 1 - z / 0.2);
  }
  for (std::size_t s = 0; s < segments; ++s) {
    const double depth = ScanSteps::kSegmentMm * (static_cast<double>(s) + 0.5);
    const double spacing = plane.line_spacing_mm(depth);
    const double across = deviation_beside_cell(lateral_mm(depth), spacing);
    LateralKernel& kernel = lateral_.emplace_back();
    kernel.half =
        std::min(LateralKernel::kMostHalf, static_cast<std::size_t>(std::ceil(kCut * across / spacing)));
    std::vector<double> weights;
    double sum = 0;
    for (std::size_t t = 0; t <= 2 * kernel.half; ++t) {
      const double x = spacing * (static_cast<double>(t) - static_cast<double>(kernel.half));
      weights.push_back(std::exp(-x * x / (2 * across * across)));
    }
    const double lateral_scale = 1 / std::sqrt(mean_square(
                                         weights.size(), [&](std::size_t t) { return weights[t]; },
                                         [&](std::size_t t) { return spacing * static_cast<double>(t); }));
    for (std::size_t t = 0; t < weights.size(); ++t) {
      kernel.weight[t] = static_cast<float>(lateral_scale * weights[t]);
      sum += lateral_scale * weights[t];
    }
    points_.push_back(static_cast<float>(taps[axial_half_] * lateral_scale));
    for (const EchoMap::Inside& inside : EchoMap::kInside)
      interfaces_.push_back(static_cast<float>(decibel(inside.interface_db) / (bell * sum)));
  }
}

double PointSpread::lateral_mm(double depth_mm) const {
  const double w0 = 1.02 * wavelength_ * focus_ / aperture_;
  const double radius = w0 * kSigmaOfWidth * std::numbers::sqrt2;  // at 1/e
  const double rayleigh = std::numbers::pi * radius * radius / wavelength_;
  const double off = (depth_mm - focus_) / rayleigh;
  const double transmitted = w0 * w0 * (1 + off * off);
  const double received = 1.02 * wavelength_ * std::max(depth_mm / aperture_, kLeastFNumber);
  return 1 / std::sqrt(1 / transmitted + 1 / (received * received));
}

}  // namespace brachy
