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

// A Gaussian across lines `spacing` mm apart, of which only each step-th is made: the weights of those between are
// shared out as linear interpolation does. Scaled to a mean square of 1 for each line of the image.
LateralKernel lateral_kernel(double sigma, double spacing) {
  LateralKernel kernel;
  while (kernel.step < LateralKernel::kTogether &&
         2 * static_cast<double>(kernel.step) * spacing <= double{Speckle::kCellMm})
    kernel.step *= 2;
  // Linear interpolation widens by the variance of its triangle, (step² − 1)/6 lines².
  const auto of_step = static_cast<double>(kernel.step);
  sigma = std::sqrt(std::max(sigma * sigma - (of_step * of_step - 1) / 6 * spacing * spacing,
                             kNarrowest * kNarrowest * spacing * spacing));
  const auto half = static_cast<std::ptrdiff_t>(
      std::min(double{LateralKernel::kMostHalf}, std::ceil(kCut * sigma / spacing)));
  const auto step = static_cast<std::ptrdiff_t>(kernel.step),
             together = static_cast<std::ptrdiff_t>(LateralKernel::kTogether);
  const auto up = [&](std::ptrdiff_t lines) { return (lines + step - 1) / step * step; };
  kernel.first = -up(half);
  kernel.count = static_cast<std::size_t>((up(half + together - 1) - kernel.first) / step + 1);
  for (std::ptrdiff_t line = 0; line < together; ++line) {
    std::vector<double> weights(kernel.count);
    for (std::ptrdiff_t m = -half; m <= half; ++m) {
      const double x = spacing * static_cast<double>(m);
      const double place = static_cast<double>(line + m - kernel.first) / static_cast<double>(step);
      const auto t = static_cast<std::size_t>(place);
      const double between = place - static_cast<double>(t), weight = std::exp(-x * x / (2 * sigma * sigma));
      weights[t] += (1 - between) * weight;
      if (between > 0) weights[t + 1] += between * weight;
    }
    const double square = mean_square(
        weights.size(), [&](std::size_t t) { return weights[t]; },
        [&](std::size_t t) { return spacing * static_cast<double>(kernel.step * t); });
    for (std::size_t t = 0; t < kernel.count; ++t)
      kernel.weight[t][static_cast<std::size_t>(line)] = static_cast<float>(weights[t] / std::sqrt(square));
  }
  return kernel;
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
                         std::size_t segments, std::size_t per_scatter)
    : wavelength_(kSpeedMmPerUs / settings.frequency_mhz),
      aperture_(settings.aperture_mm),
      focus_(settings.focus_mm),
      sample_mm_(double{ScanSteps::kScatterMm} / static_cast<double>(per_scatter)),
      axial_mm_(0.5 * settings.pulse_cycles * wavelength_),
      elevation_sigma_(settings.elevation_mm * kSigmaOfWidth) {
  const double sigma = deviation_beside_cell(axial_mm_, sample_mm_);
  axial_mm_ = std::sqrt(sigma * sigma + kCellVariance) / kSigmaOfWidth;
  const double across_square = mean_square(
      speckle.planes, [&](std::size_t p) { return double{speckle.weight[p]}; },
      [&](std::size_t p) { return double{speckle.offset_mm[p]}; });
  const double scattered = ScanSteps::kScatterMm;
  axial_.half =
      std::min(AxialKernel::kMost / 2 - 1, static_cast<std::size_t>(std::ceil(kCut * sigma / scattered)));
  axial_.count = 2 * axial_.half + 2;
  axial_.per_scatter = per_scatter;
  double bell = 0;  // what a surface 0.4 mm thick becomes (scatter_loop.h)
  for (std::size_t phase = 0; phase < per_scatter; ++phase) {
    std::vector<double> taps;
    for (std::size_t t = 0; t < axial_.count; ++t) {
      const double z = scattered * (static_cast<double>(t) - static_cast<double>(axial_.half)) -
                       sample_mm_ * static_cast<double>(phase);
      taps.push_back(std::exp(-z * z / (2 * sigma * sigma)));
      if (phase == 0) bell += taps.back() * std::max(0.0, 1 - std::abs(z) / 0.2);
    }
    const double square = mean_square(
        taps.size(), [&](std::size_t t) { return taps[t]; },
        [&](std::size_t t) { return scattered * static_cast<double>(t); });
    const double scale = 1 / std::sqrt(2 * square * across_square);  // 2: both parts of a complex value
    for (std::size_t t = 0; t < axial_.count; ++t)
      axial_.weight[phase][t] = static_cast<float>(scale * taps[t]);
    if (phase == 0) bell *= scale;
  }
  pulse_half_ = static_cast<std::size_t>(std::ceil(kCut * sigma / sample_mm_));
  for (std::size_t k = 0; k <= pulse_half_ * static_cast<std::size_t>(kPulseSteps); ++k) {
    const double z = sample_mm_ * static_cast<double>(k) / double{kPulseSteps};
    pulse_.push_back(static_cast<float>(std::exp(-z * z / (2 * sigma * sigma))));
  }
  for (std::size_t s = 0; s < segments; ++s) {
    const double depth = ScanSteps::kSegmentMm * (static_cast<double>(s) + 0.5);
    const double spacing = plane.line_spacing_mm(depth);
    const double across = deviation_beside_cell(lateral_mm(depth), spacing);
    const LateralKernel& kernel = lateral_.emplace_back(lateral_kernel(across, spacing));
    double sum = 0;
    for (std::size_t t = 0; t < kernel.count; ++t) sum += double{kernel.weight[t][0]};
    const auto middle = static_cast<std::size_t>(-kernel.first) / kernel.step;
    points_.push_back(kernel.weight[middle][0]);
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
