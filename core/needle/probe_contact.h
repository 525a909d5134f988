#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/surface/surface_mesh.h"
#include "core/models/displacement_field.h"
#include "core/needle/body_frame.h"
#include "core/needle/contact_settings.h"
#include "core/needle/contact_state.h"
#include "core/needle/local_contact_model.h"
#include "core/needle/needle_forces.h"
#include "core/needle/needle_landmark.h"
#include "core/needle/probe_settings.h"

namespace brachy {

/// The contact of a transrectal probe, a rigid cylinder with a round tip, with the gland behind the rectal wall
/// (core/DESIGN.md, section 5). Its pose X_WP is as a needle's: tip at the origin, +z along the axis to the tip.
///
/// Points of the gland's surface, `landmark_spacing_mm` apart, are landmarks while they would be inside the probe. Each
/// is pushed out of it along the normal at its deformed place of the last tick; it pushes back only, and slides
/// freely across the normal, as with contact gel.
/// Limits: the rectal wall is as thick everywhere and follows the probe; between landmarks and beyond the last of them
/// the gland comes into it by 0.7 mm where the probe pushes by 3 mm, by 1.4 mm at 6 mm.
/// Threads: one. Real-time: no allocation after construction, no exceptions.
class ProbeContact {
 public:
  /// `surface`: the tissue's, at rest.
  ProbeContact(const SurfaceMesh& surface, const ProbeSettings& probe, const ContactSettings& contact);

  /// Starts a tick with its pose. `last_field` is the field of the last tick; `frame`: where the body is. Landmarks are
  /// in its frame B.
  void begin(const RigidTransform& X_WP, const DisplacementField& last_field,
             const BodyFrame& frame) noexcept;
  /// A tick without a pose: no landmarks, no force.
  void skip() noexcept;

  std::span<NeedleLandmark> landmarks() { return landmarks_; }
  std::span<const NeedleLandmark> landmarks() const { return landmarks_; }
  /// Where it pushes, on the whole: unit, in the frame B.
  const Vec3& direction() const { return direction_; }

  /// Ends a tick with the landmarks' reactions; `stiffness_n_per_mm`: of all of them together along direction().
  void finish(std::uint64_t tick, double stiffness_n_per_mm) noexcept;

  ContactState state() const { return state_; }
  std::uint32_t flags() const { return flags_; }  ///< StepFlag bits of this tick
  double indentation_mm() const {
    return indentation_;
  }  ///< the farthest that the gland's surface has been pushed
  const NeedleForces& forces() const { return forces_; }
  const LocalContactModel& local_model() const { return local_model_; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(points_, pose_, state_, flags_, landmarks_, touching_, direction_, indentation_, forces_,
            local_model_);
  }

 private:
  struct Point {
    Vec3 position = Vec3::Zero();  // at rest, B, mm
    Vec3 normal = Vec3::Zero();    // of the probe where the point lies against it; 0: it does not
    double pressed_n = 0;          // in the last tick

    template <class Archive>
    void list_state(Archive& archive) {
      archive(position, normal, pressed_n);
    }
  };
  Vec3 nearest_on_axis(const Vec3& p) const noexcept;
  void update(std::size_t point, const DisplacementField& last_field) noexcept;

  ProbeSettings probe_;
  double max_displacement_;
  std::vector<Point> points_;
  Vec3 centre_ = Vec3::Zero();  // of the gland at rest, mm

  /// In B, but for world_tip in W; mm.
  struct Pose {
    Vec3 tip = Vec3::Zero(), axis = Vec3::UnitZ();
    Vec3 world_tip = Vec3::Zero();
    Mat3 turn = Mat3::Identity();  // B to W

    template <class Archive>
    void list_state(Archive& archive) {
      archive(tip, axis, world_tip, turn);
    }
  };
  Pose pose_;
  ContactState state_ = ContactState::kFree;
  std::uint32_t flags_ = 0;
  std::vector<NeedleLandmark> landmarks_;
  std::vector<std::size_t> touching_;  // points of landmarks_
  Vec3 direction_ = Vec3::UnitY();
  double indentation_ = 0;
  NeedleForces forces_;
  LocalContactModel local_model_;
};

}  // namespace brachy
