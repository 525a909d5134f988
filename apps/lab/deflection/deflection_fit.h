#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/lab/deflection/needle_path.h"

namespace brachy {

/// One measured insertion: the tip's depth and how far it is off its first pose, without that pose. mm.
struct MeasuredInsertion {
  int number = 0;
  std::vector<double> depth_mm = {};
  std::array<std::vector<double>, 2> across_mm = {};  ///< x and z
};

/// Reads insertion,step,depth_mm,x_mm,z_mm; rows of an insertion follow each other, with increasing depths. Errors:
/// UserError "file:line: what; fix"; at least four insertions of three poses each.
std::vector<MeasuredInsertion> load_insertions(const std::filesystem::path& file);

/// What the fit assumes of measurements: standard deviations of the tracker (mm), and from one insertion to another of
/// the entry angle (degrees) and of the first pose (mm).
struct ScatterSettings {
  double noise_mm = 0.08, angle_deg = 0.5, origin_mm = 0.15;
};

/// y(d) = F p(d; μ) + (θ₀ + δθ) d + o across each of two directions: p the path of needle_path for 1 N, F, θ₀ and μ of
/// the phantom, δθ and o of the insertion, normal with ScatterSettings.
struct DeflectionFit {
  std::size_t modulus = 0;  ///< of the grid
  std::array<double, 2> force_n{}, angle_rad{};
  double minus_two_log_likelihood = 0;
};

/// Errors of predicted insertions, over the poses that the prediction was not told. mm.
struct PredictionErrors {
  std::size_t predicted = 0, passed_splits = 0, splits = 0;
  double end_mean_mm = 0, end_max_mm = 0, rms_mean_mm = 0, rms_max_mm = 0;
};

/// Fits by generalised least squares for each modulus of a grid, and takes the most likely one.
class DeflectionStudy {
 public:
  /// Limits of a prediction: at the end, and rms along the path.
  static constexpr double kEndMm = 0.5, kRmsMm = 0.3;

  /// `moduli`: the grid, N/mm².
  DeflectionStudy(std::vector<MeasuredInsertion> insertions, const NeedlePathSettings& needle,
                  const ScatterSettings& scatter, std::vector<double> moduli);

  const std::vector<double>& moduli() const { return moduli_; }
  std::size_t insertions() const { return insertions_.size(); }
  /// Of these insertions. `is_straight`: no needle at all, F = 0.
  DeflectionFit fit(const std::vector<std::size_t>& which, bool is_straight = false) const;
  /// The moduli whose −2 ln L is within 3.84 of the least: 95 %. The grid's numbers of the first and the last.
  std::array<std::size_t, 2> interval(const std::vector<std::size_t>& which) const;
  /// Fits every choice of three insertions and predicts the others, each told its own poses up to `calibrate_mm`.
  PredictionErrors predict(double calibrate_mm, bool is_straight = false) const;

 private:
  DeflectionFit fit_modulus(const std::vector<std::size_t>& which, std::size_t modulus,
                            bool is_straight) const;
  double path_at(std::size_t modulus, double depth_mm) const;

  std::vector<MeasuredInsertion> insertions_;
  ScatterSettings scatter_;
  double step_mm_;
  std::vector<double> moduli_;
  std::vector<std::vector<double>> paths_;  // of each modulus
};

}  // namespace brachy
