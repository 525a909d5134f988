#include "haptics/simulated/device_dynamics.h"

#include <cmath>

namespace brachy {

namespace {

using Mat5 = Eigen::Matrix<double, 5, 5>;

// exp(A) by scaling, the series, and squaring.
Mat5 exponential(const Mat5& A) {
  const double size = A.cwiseAbs().rowwise().sum().maxCoeff();
  const int halvings = size > 0.25 ? static_cast<int>(std::ceil(std::log2(size / 0.25))) : 0;
  const Mat5 small = A / std::exp2(halvings);
  Mat5 sum = Mat5::Identity(), term = Mat5::Identity();
  for (int n = 1; n <= 14; ++n) {  // 0.25^15 / 15! is far below rounding
    term = (term * small / n).eval();
    sum += term;
  }
  for (int i = 0; i < halvings; ++i) sum = (sum * sum).eval();
  return sum;
}

Mat5 transition(const DeviceDynamicsSettings& s, double period_s) {
  const double mass = 1e-3 * s.mass_kg;  // N·s²/mm
  Mat5 A = Mat5::Zero();
  A(0, 1) = 1;
  A.row(1) << -s.hand_stiffness_n_per_mm, -s.damping_n_s_per_mm - s.hand_damping_n_s_per_mm,
      s.hand_stiffness_n_per_mm, s.hand_damping_n_s_per_mm, 1;
  A.row(1) /= mass;
  A(2, 3) = 1;
  return exponential(A * period_s);
}

}  // namespace

DeviceDynamics::DeviceDynamics(const DeviceDynamicsSettings& settings, const Vec3& start)
    : encoder_mm_(settings.encoder_mm),
      period_s_(1 / settings.rate_hz),
      transition_(transition(settings, period_s_)),
      state_(Eigen::Matrix<double, 5, 3>::Zero()) {
  state_.row(0) = state_.row(2) = start;
}

void DeviceDynamics::advance(const Vec3& force_n, const Vec3& hand) {
  state_.row(3) = (hand.transpose() - state_.row(2)) / period_s_;
  state_.row(4) = force_n;
  state_ = (transition_ * state_).eval();
  state_.row(2) = hand;  // without the rounding of many steps
}

void DeviceDynamics::displace(const Vec3& tip) {
  state_.row(0) = tip;
  state_.row(1).setZero();
}

Vec3 DeviceDynamics::measured_tip() const {
  if (encoder_mm_ <= 0) return tip();
  return (tip() / encoder_mm_).array().round() * encoder_mm_;
}

}  // namespace brachy
