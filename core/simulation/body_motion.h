#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/elasticity/landmark_compliance.h"
#include "core/models/displacement_field.h"
#include "core/needle/body_frame.h"
#include "core/simulation/body_settings.h"

namespace brachy {

/// The tissue's motion as a whole: six modes on the gland's ligaments, and swelling, between ticks. It comes after
/// the field that the landmarks make, in whose frame B the tissue rests; det ∇ of the whole is that of the field times
/// det A > 0, so the field's certificate is the whole's.
/// Threads: one. Real-time: no allocation.
class BodyMotion {
 public:
  /// `pivot`: the apex, about which the gland turns and swells, mm. `held`: translation's and rotation's compliance
  /// that the model's own walls have already (elastic_body_compliance): what is left of the settings' compliance is the
  /// body's, so that nothing holds twice. Errors: UserError where the walls give more than the settings allow.
  BodyMotion(const GlandSettings& gland, const SwellingSettings& swelling, const Vec3& pivot,
             const Vec6& held);

  const BodyFrame& frame() const { return frame_; }
  /// mm/N and rad/(N·mm) by direction; none where the gland does not move.
  const std::optional<Vec6>& compliance() const { return compliance_; }
  const Vec3& pivot() const { return pivot_; }
  const Vec6& motion() const { return motion_; }  ///< mm, rad

  void set_motion(const Vec6& motion) noexcept;
  /// Is as swollen as `other`.
  void resume_from(const BodyMotion& other) noexcept;
  /// The next tick, after so many punctures of all needles.
  void swell(std::uint64_t punctures, double period_s) noexcept;
  double swelling_share() const { return share_; }  ///< of the day-0 swelling

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(motion_, share_, frame_);
  }

 private:
  void update_frame() noexcept;

  SwellingSettings swelling_;
  Vec3 pivot_;
  std::optional<Vec6> compliance_;
  Vec6 motion_ = Vec6::Zero();
  double share_ = 0;
  BodyFrame frame_;
};

/// The field u of the body's frame, seen in the world: X ↦ A (X + u(X)) + b − X at single points.
class MovedField : public DisplacementField {
 public:
  MovedField(DisplacementField& field, const BodyFrame& frame) : field_(field), frame_(frame) {}

  std::span<const std::uint32_t> touched() const override { return field_.touched(); }
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return field_.displacement(block);
  }
  Vec3 displacement_at(const Vec3& X) const noexcept override {
    const Vec3 u = field_.displacement_at(X);
    return frame_.is_identity() ? u : Vec3(frame_.to_world(X + u) - X);
  }
  void displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept override {
    field_.displacements_at(X, u);
    if (frame_.is_identity()) return;
    for (std::size_t i = 0; i < X.size(); ++i) u[i] = frame_.to_world(X[i] + u[i]) - X[i];
  }

 private:
  DisplacementField& field_;
  const BodyFrame& frame_;
};

}  // namespace brachy
