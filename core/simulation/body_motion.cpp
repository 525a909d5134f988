#include "core/simulation/body_motion.h"

#include <cmath>
#include <numbers>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace brachy {
namespace {

constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr double kSettled = 1e-6;  // of the swelling: below this it has not begun

}  // namespace

BodyMotion::BodyMotion(const GlandSettings& gland, const SwellingSettings& swelling, const Vec3& pivot,
                       const Vec6& held)
    : swelling_(swelling), pivot_(pivot) {
  if (!gland.moves) return;
  const double rotation = std::numbers::pi / 180 / gland.rotation_nmm_per_deg;
  Vec6 whole;
  whole << gland.stiffness_n_per_mm.cwiseInverse(), Vec3::Constant(rotation);
  const Vec6 left = whole - held;
  for (int i = 0; i < 3; ++i) {
    if (left[i] < 0)
      throw UserError("gland.stiffness_n_per_mm along " + std::string(kAxes[i]) + " is " +
                      text_of(gland.stiffness_n_per_mm[i]) + "; the box's walls alone allow at most " +
                      text_of(1 / held[i]));
    if (left[3 + i] < 0)
      throw UserError("gland.rotation_nmm_per_deg is " + text_of(gland.rotation_nmm_per_deg) +
                      "; the box's walls alone allow at most " +
                      text_of(std::numbers::pi / 180 / held[3 + i]));
  }
  compliance_ = left;
}

void BodyMotion::set_motion(const Vec6& motion) noexcept {
  if (motion == motion_) return;
  motion_ = motion;
  update_frame();
}

void BodyMotion::resume_from(const BodyMotion& other) noexcept {
  share_ = other.share_;
  update_frame();
}

void BodyMotion::swell(std::uint64_t punctures, double period_s) noexcept {
  if (!swelling_.on || punctures == 0) return;
  const double goal = SwellingSettings::kTheatre *
                      (1 - std::exp(-static_cast<double>(punctures) / SwellingSettings::kPunctures));
  if (std::abs(goal - share_) < kSettled) return;
  share_ += (goal - share_) * (1 - std::exp(-period_s / swelling_.build_up_s));
  update_frame();
}

void BodyMotion::update_frame() noexcept {
  const Vec3 turn = motion_.tail<3>();
  const double angle = turn.norm();
  Mat3 A = Mat3::Identity();
  if (angle > 0) A = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  A = A * SwellingSettings::stretch(share_).asDiagonal();
  frame_ = BodyFrame(A, pivot_ + motion_.head<3>() - A * pivot_);
}

}  // namespace brachy
