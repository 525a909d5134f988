#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "core/ultrasound/image_plane.h"
#include "core/ultrasound/scan_loops.h"

namespace brachy {

/// The resolution cell and the kernels that give it: a Gaussian pulse and a Gaussian beam (core/ultrasound/README.md).
///
///   axial       half of pulse_cycles wavelengths c/f, c = 1.54 mm/µs
///   lateral     1/w² = 1/w_t² + 1/w_r²: the transmitted beam is Gaussian about its focus,
///               w_t = w_0 √(1 + ((z − z_f)/z_R)²), w_0 = 1.02 λ z_f / D (the usual width at −6 dB of a focused beam),
///               z_R its Rayleigh length; the received one follows the depth, w_r = 1.02 λ max(z/D, 2)
/// All full widths at half maximum of the pressure, which is also that of the autocovariance of the speckle's envelope
/// (R. F. Wagner et al., IEEE Trans. Sonics Ultrason. 30, 1983). The scatterers' own correlation, cell²/6 in the
/// variance, is part of it. Kernels are scaled so that speckle of level 0 dB has a mean square of 1 at every depth.
/// Threads: any. Constant.
class PointSpread {
 public:
  /// `per_scatter`: samples of the scan for each of scatterers, 1 or 2.
  PointSpread(const UltrasoundSettings& settings, const ImagePlane& plane, const Speckle& speckle,
              std::size_t segments, std::size_t per_scatter);

  double axial_mm() const { return axial_mm_; }  ///< of the resolution cell
  double lateral_mm(double depth_mm) const;
  double elevation_sigma_mm() const { return elevation_sigma_; }

  const AxialKernel& axial() const { return axial_; }
  double sample_mm() const { return sample_mm_; }  ///< of the scan, along a line
  /// The pulse of a point, 1 in its middle, so many samples from there; 0 from pulse_half() on.
  std::size_t pulse_half() const { return pulse_half_; }
  float pulse(float samples) const {
    const float at = std::abs(samples) * kPulseSteps;
    const auto i = static_cast<std::size_t>(at);
    return i + 1 < pulse_.size() ? pulse_[i] + (at - static_cast<float>(i)) * (pulse_[i + 1] - pulse_[i]) : 0;
  }
  const LateralKernel& lateral(std::size_t segment) const { return lateral_[segment]; }
  /// What a point with the pulse of pressure 1 becomes at its peak, in a segment.
  float point_response(std::size_t segment) const { return points_[segment]; }
  /// EchoMap::kBoundaries of each segment: pressure of a surface that is to be as bright as its interface_db.
  const float* interface_scale() const { return interfaces_.data(); }

 private:
  static constexpr float kPulseSteps = 16;  // of a sample
  double wavelength_, aperture_, focus_, sample_mm_, axial_mm_, elevation_sigma_;
  AxialKernel axial_;
  std::size_t pulse_half_ = 0;
  std::vector<float> pulse_, points_, interfaces_;
  std::vector<LateralKernel> lateral_;
};

/// The planes that the slice is summed of, with Gaussian weights.
Speckle speckle_of(const UltrasoundSettings& settings);

}  // namespace brachy
