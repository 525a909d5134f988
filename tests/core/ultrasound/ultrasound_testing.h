#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "core/scene/load_simulation_model.h"
#include "core/scene/load_structures.h"
#include "core/scene/load_tissue.h"
#include "core/scene/load_ultrasound.h"
#include "core/simulation/simulator.h"

namespace brachy::test {

/// A displacement field given by a function.
template <class Function>
class FunctionField : public DisplacementField {
 public:
  explicit FunctionField(Function u) : u_(u) {}
  std::span<const std::uint32_t> touched() const override { return {&any_, 1}; }
  const BlockDisplacement<float>& displacement(std::uint32_t) const override { return none_; }
  Vec3 displacement_at(const Vec3& X) const noexcept override { return u_(X); }

 private:
  Function u_;
  std::uint32_t any_ = 0;
  BlockDisplacement<float> none_{};
};

/// Homogeneous tissue without wall, noise and attenuation.
inline UltrasoundImager::Options plain_options(const std::string& array = "sagittal") {
  UltrasoundImager::Options options;
  options.settings.array = array;
  options.settings.noise_db = -150;
  options.settings.attenuation_db_per_cm_mhz = 0;
  options.settings.dynamic_range_db = 120;
  options.rectal_wall_mm = 0;
  return options;
}

inline RigidTransform probe_below() {
  RigidTransform X_WP;
  X_WP.p = Vec3(0, -34, 40);
  return X_WP;
}

inline ImageResult render(UltrasoundImager& imager, DisplacementField& field,
                          std::span<const NeedleState> needles = {}, std::span<const Seed> seeds = {}) {
  const BodyFrame frame;
  return imager.render({field, frame, Verdict::kInjective, 1, needles, seeds, probe_below()});
}

/// A sample of the scan as pressure; speckle's mean square is 1.
inline double pressure_at(const UltrasoundImager& imager, std::size_t line, std::size_t sample) {
  const double gray = static_cast<double>(imager.gray_scan()[line * imager.samples_per_line() + sample]);
  return std::pow(10, 0.05 * imager.level_db(gray));
}

/// The brightest spot around p: the centroid of the power about its peak.
inline PlanePoint spot_near(const UltrasoundImager& imager, const PlanePoint& p, double reach_mm) {
  const ImagePlane& plane = imager.plane();
  const LinePoint at = plane.find(p);
  const auto lines = static_cast<int>(reach_mm / plane.line_spacing_mm(at.depth)),
             samples = static_cast<int>(0.5 * reach_mm / imager.sample_mm());
  const auto l0 = static_cast<int>(std::round(at.line)),
             s0 = static_cast<int>(std::round(at.depth / imager.sample_mm()));
  const auto power = [&](int l, int s) {
    return std::pow(pressure_at(imager, static_cast<std::size_t>(l), static_cast<std::size_t>(s)), 2);
  };
  double best = -1;
  int peak_line = 0, peak_sample = 0;
  for (int l = l0 - lines; l <= l0 + lines; ++l)
    for (int s = s0 - samples; s <= s0 + samples; ++s)
      if (power(l, s) > best) {
        best = power(l, s);
        peak_line = l;
        peak_sample = s;
      }
  const auto near = static_cast<int>(std::lround(0.24 / imager.sample_mm()));
  double sum = 0, line = 0, sample = 0;
  for (int l = peak_line - lines; l <= peak_line + lines; ++l)
    for (int s = peak_sample - near; s <= peak_sample + near; ++s) {
      sum += power(l, s);
      line += power(l, s) * l;
      sample += power(l, s) * s;
    }
  return plane.at(line / sum, sample / sum * imager.sample_mm());
}

inline double apart(const PlanePoint& a, const PlanePoint& b) {
  return std::hypot(a.a - b.a, a.b - b.b);
}

}  // namespace brachy::test
