#include "apps/lab/deflection/deflection_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_csv.h"

namespace brachy {
namespace {

constexpr const char* kHeader = "insertion,step,depth_mm,x_mm,z_mm";
constexpr std::size_t kTrained = 3;     // insertions of a fit
constexpr double kInterval = 3.84;      // χ² of one parameter, 95 %
constexpr std::size_t kLeastPoses = 3;  // of an insertion

Eigen::VectorXd depths_of(const MeasuredInsertion& insertion) {
  return Eigen::Map<const Eigen::VectorXd>(insertion.depth_mm.data(),
                                           static_cast<Eigen::Index>(insertion.depth_mm.size()));
}

// σ² I + σ_θ² d dᵀ + σ_o² 1 1ᵀ
Eigen::MatrixXd covariance(const Eigen::VectorXd& d, const ScatterSettings& s) {
  const double angle = s.angle_deg * std::numbers::pi / 180;
  return s.noise_mm * s.noise_mm * Eigen::MatrixXd::Identity(d.size(), d.size()) +
         angle * angle * d * d.transpose() +
         s.origin_mm * s.origin_mm * Eigen::MatrixXd::Ones(d.size(), d.size());
}

}  // namespace

std::vector<MeasuredInsertion> load_insertions(const std::filesystem::path& file) {
  const NumberTable table = load_number_csv(file, kHeader);
  const std::string name = file.string();
  std::vector<MeasuredInsertion> insertions;
  std::array<double, 3> first{};
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto row = table.row(i);
    const int number = static_cast<int>(row[0]);
    if (insertions.empty() || insertions.back().number != number) {
      if (std::ranges::any_of(insertions, [&](const auto& known) { return known.number == number; }))
        refuse_line(name, table.lines[i],
                    "insertion " + std::to_string(number) + " comes twice; put its rows together");
      insertions.push_back({.number = number});
      first = {row[2], row[3], row[4]};
      continue;
    }
    MeasuredInsertion& insertion = insertions.back();
    const double depth = row[2] - first[0];
    if (depth <= (insertion.depth_mm.empty() ? 0 : insertion.depth_mm.back()))
      refuse_line(name, table.lines[i], "depth_mm must increase within an insertion; sort its rows");
    insertion.depth_mm.push_back(depth);
    for (std::size_t k = 0; k < 2; ++k) insertion.across_mm[k].push_back(row[3 + k] - first[1 + k]);
  }
  for (const MeasuredInsertion& insertion : insertions)
    if (insertion.depth_mm.size() < kLeastPoses)
      throw UserError(name + ": insertion " + std::to_string(insertion.number) + " has fewer than " +
                      std::to_string(kLeastPoses + 1) + " poses; leave it out");
  if (insertions.size() <= kTrained)
    throw UserError(name + ": has " + std::to_string(insertions.size()) + " insertions; " +
                    std::to_string(kTrained) + " are fitted and at least one is predicted");
  return insertions;
}

DeflectionStudy::DeflectionStudy(std::vector<MeasuredInsertion> insertions, const NeedlePathSettings& needle,
                                 const ScatterSettings& scatter, std::vector<double> moduli)
    : insertions_(std::move(insertions)),
      scatter_(scatter),
      step_mm_(needle.step_mm),
      moduli_(std::move(moduli)) {
  NeedlePathSettings settings = needle;
  for (const MeasuredInsertion& insertion : insertions_)
    settings.depth_mm = std::max(settings.depth_mm, insertion.depth_mm.back() + 2 * step_mm_);
  if (settings.depth_mm > 0.9 * settings.needle_length_mm)
    throw UserError("the insertions are " + std::to_string(settings.depth_mm) +
                    " mm deep, too deep for the needle's length; give --needle-length-mm");
  for (const double modulus : moduli_) {
    settings.shear_modulus = modulus;
    paths_.push_back(needle_path(settings));
  }
}

double DeflectionStudy::path_at(std::size_t modulus, double depth_mm) const {
  const std::vector<double>& path = paths_[modulus];
  const double at = depth_mm / step_mm_;
  const auto i = std::min(static_cast<std::size_t>(at), path.size() - 2);
  const double share = at - static_cast<double>(i);
  return (1 - share) * path[i] + share * path[i + 1];
}

DeflectionFit DeflectionStudy::fit_modulus(const std::vector<std::size_t>& which, std::size_t modulus,
                                           bool is_straight) const {
  Eigen::Matrix2d N = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d b = Eigen::Matrix2d::Zero();  // a column for each direction
  double yy = 0, log_det = 0;
  for (const std::size_t w : which) {
    const Eigen::VectorXd d = depths_of(insertions_[w]);
    Eigen::MatrixXd A(d.size(), 2), y(d.size(), 2);
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      A(i, 0) = is_straight ? 0 : path_at(modulus, d[i]);
      A(i, 1) = d[i];
      for (std::size_t k = 0; k < 2; ++k)
        y(i, static_cast<Eigen::Index>(k)) = insertions_[w].across_mm[k][static_cast<std::size_t>(i)];
    }
    const Eigen::LLT<Eigen::MatrixXd> V(covariance(d, scatter_));
    const Eigen::MatrixXd weighted = V.solve(A);
    N += A.transpose() * weighted;
    b += weighted.transpose() * y;
    yy += (y.transpose() * V.solve(y)).trace();
    for (Eigen::Index i = 0; i < d.size(); ++i) log_det += 2 * 2 * std::log(V.matrixLLT()(i, i));
  }
  if (is_straight) N(0, 0) = 1;
  const Eigen::Matrix2d beta = N.inverse() * b;
  DeflectionFit fit{.modulus = modulus};
  for (Eigen::Index k = 0; k < 2; ++k) {
    fit.force_n[static_cast<std::size_t>(k)] = beta(0, k);
    fit.angle_rad[static_cast<std::size_t>(k)] = beta(1, k);
  }
  fit.minus_two_log_likelihood = yy - (b.transpose() * beta).trace() + log_det;
  return fit;
}

DeflectionFit DeflectionStudy::fit(const std::vector<std::size_t>& which, bool is_straight) const {
  DeflectionFit best;
  best.minus_two_log_likelihood = std::numeric_limits<double>::infinity();
  for (std::size_t m = 0; m < (is_straight ? 1 : moduli_.size()); ++m)
    if (const DeflectionFit tried = fit_modulus(which, m, is_straight);
        tried.minus_two_log_likelihood < best.minus_two_log_likelihood)
      best = tried;
  return best;
}

std::array<std::size_t, 2> DeflectionStudy::interval(const std::vector<std::size_t>& which) const {
  const double least = fit(which).minus_two_log_likelihood;
  std::array<std::size_t, 2> ends = {moduli_.size(), 0};
  for (std::size_t m = 0; m < moduli_.size(); ++m) {
    if (fit_modulus(which, m, false).minus_two_log_likelihood > least + kInterval) continue;
    ends[0] = std::min(ends[0], m);
    ends[1] = std::max(ends[1], m);
  }
  return ends;
}

PredictionErrors DeflectionStudy::predict(double calibrate_mm, bool is_straight) const {
  PredictionErrors errors;
  const std::size_t n = insertions_.size();
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b)
      for (std::size_t c = b + 1; c < n; ++c) {
        const DeflectionFit fitted = fit({a, b, c}, is_straight);
        bool passes = true;
        for (std::size_t held = 0; held < n; ++held) {
          if (held == a || held == b || held == c) continue;
          const MeasuredInsertion& insertion = insertions_[held];
          const Eigen::VectorXd d = depths_of(insertion);
          const auto told = static_cast<Eigen::Index>(
              std::ranges::count_if(insertion.depth_mm, [&](double depth) { return depth <= calibrate_mm; }));
          Eigen::MatrixXd left(d.size(), 2);  // measured less the phantom's part
          for (Eigen::Index i = 0; i < d.size(); ++i)
            for (std::size_t k = 0; k < 2; ++k)
              left(i, static_cast<Eigen::Index>(k)) =
                  insertion.across_mm[k][static_cast<std::size_t>(i)] - fitted.angle_rad[k] * d[i] -
                  (is_straight ? 0 : fitted.force_n[k] * path_at(fitted.modulus, d[i]));
          if (told > 0) {
            // The most likely δθ and o, by what was told: P Uᵀ V⁻¹ left.
            const Eigen::MatrixXd V = covariance(d.head(told), scatter_);
            Eigen::MatrixXd U(d.size(), 2);
            U << d, Eigen::VectorXd::Ones(d.size());
            const double angle = scatter_.angle_deg * std::numbers::pi / 180;
            const Eigen::Vector2d P(angle * angle, scatter_.origin_mm * scatter_.origin_mm);
            const Eigen::MatrixXd own =
                P.asDiagonal() * (U.topRows(told).transpose() * V.llt().solve(left.topRows(told)));
            left -= U * own;
          }
          const Eigen::Index untold = d.size() - told;
          if (untold == 0) continue;
          const double end = left.row(d.size() - 1).norm(),
                       rms = std::sqrt(left.bottomRows(untold).squaredNorm() / static_cast<double>(untold));
          ++errors.predicted;
          errors.end_mean_mm += end;
          errors.rms_mean_mm += rms;
          errors.end_max_mm = std::max(errors.end_max_mm, end);
          errors.rms_max_mm = std::max(errors.rms_max_mm, rms);
          passes &= end <= kEndMm && rms <= kRmsMm;
        }
        ++errors.splits;
        errors.passed_splits += passes;
      }
  if (errors.predicted == 0) throw UserError("no pose lies beyond the calibrated depth; give a lower one");
  errors.end_mean_mm /= static_cast<double>(errors.predicted);
  errors.rms_mean_mm /= static_cast<double>(errors.predicted);
  return errors;
}

}  // namespace brachy
