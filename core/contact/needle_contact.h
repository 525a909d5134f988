#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/contact/contact_settings.h"
#include "core/contact/cut_path.h"
#include "core/field/tissue_field.h"
#include "core/sim/mesh_state.h"
#include "core/surface/surface_bvh.h"

namespace brachy {

/// From the needle's pose to the landmarks that carry the tissue along.
///
/// free → touching: the tip's sweep since the last tick crosses the surface, or the shaft lies across it.
/// touching → inserted: the tip has pushed puncture_indentation_mm past the contact point along the needle.
/// inserted → through: the tip's material point leaves through the far side; back again when the tip returns.
/// inserted → withdrawn: the tip is back at the entry and out; every landmark is released.
/// A pose that starts inside, or jumps, is seated: the needle stands in the tissue as if it had always been there.
///
/// Contact with the deformed surface is decided in the rest shape: landmarks exist only because of this needle, so
/// tissue springs back to rest where it is not held, and X + u(X) crosses the deformed surface exactly where the
/// material point X crosses the surface at rest.
///
/// The only memory is here: contact point or cut path, shaft landmarks, last pose.
/// Limits: a tip that leaves and enters a second lobe stays `through`; one needle.
/// Threads: one. Real-time: no allocation after construction, no exceptions; a few BVH queries a call.
class NeedleContact {
 public:
  /// `surface` (closed, outward, at rest) must outlive this.
  NeedleContact(const SurfaceBvh& surface, const NeedleSettings& needle, const ContactSettings& settings);

  /// Takes the pose of this tick. `last_field` is the field solved in the last tick: a new shaft landmark starts
  /// with its displacement. None: at rest.
  void update(const RigidTransform& X_WN, const TissueField* last_field) noexcept;

  ContactState state() const { return state_; }
  std::span<const Vec3> positions() const { return positions_; }          ///< landmarks at rest, mm
  std::span<const Vec3> displacements() const { return displacements_; }  ///< mm
  double insertion_depth() const { return insertion_depth_; }             ///< mm, along the cut path
  std::uint32_t puncture_count() const { return puncture_count_; }
  std::uint32_t flags() const { return flags_; }  ///< StepFlag bits of this tick

  /// Share of the puncture's push that the hardest driven landmark carries, 0 … 1: what loads dynamic anchors.
  double load() const noexcept;

 private:
  struct Needle {  // this tick's pose, taken apart
    Vec3 hub, tip, axis;
    Vec3 nearest_on_line(const Vec3& p) const { return tip + (p - tip).dot(axis) * axis; }
  };
  struct ShaftLandmark {
    Vec3 position;     // material point on the cut path
    double axial = 0;  // how far friction has carried it along the needle, mm
  };

  void seat(const Needle& needle) noexcept;
  void approach(const Needle& needle) noexcept;
  void press(const Needle& needle) noexcept;
  void puncture(const Needle& needle) noexcept;
  void move_tip(const Needle& needle) noexcept;
  void cut(const Needle& needle, double distance) noexcept;
  void move_shaft(const Needle& needle, double axial_motion, const TissueField* last_field) noexcept;
  void release() noexcept;
  void collect(const Needle& needle) noexcept;
  void add_landmark(const Vec3& position, const Vec3& displacement) noexcept;

  const SurfaceBvh& surface_;
  NeedleSettings needle_settings_;
  ContactSettings settings_;

  ContactState state_ = ContactState::kFree;
  bool has_last_pose_ = false;
  Vec3 last_tip_ = Vec3::Zero();
  bool was_inserted_ = false;  // decides between free and withdrawn

  // touching
  Vec3 contact_point_ = Vec3::Zero();  // material, on the surface
  Vec3 contact_normal_ = Vec3::Zero();
  bool by_tip_ = false;  // the tip presses; otherwise the shaft lies against the surface

  // inserted, through
  CutPath path_;
  double tip_s_ = 0;  // arc length of the tip's material point
  std::vector<ShaftLandmark> shaft_;

  std::vector<Vec3> positions_, displacements_;
  double insertion_depth_ = 0;
  std::uint32_t puncture_count_ = 0;
  std::uint32_t flags_ = 0;
};

}  // namespace brachy
