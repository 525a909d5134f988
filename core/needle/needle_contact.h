#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/geometry/surface/surface_bvh.h"
#include "core/models/displacement_field.h"
#include "core/needle/body_frame.h"
#include "core/needle/contact_settings.h"
#include "core/needle/contact_state.h"
#include "core/needle/cut_path.h"
#include "core/needle/followed_course.h"
#include "core/needle/local_contact_model.h"
#include "core/needle/needle_bend.h"
#include "core/needle/needle_forces.h"
#include "core/needle/needle_landmark.h"
#include "core/needle/needle_tissues.h"
#include "core/needle/side_contact.h"

namespace brachy {

/// One needle's contact: from its pose to the landmarks that displace the tissue, and from their reactions
/// to cut and forces (core/DESIGN.md, section 5).
///
/// free → touching: the tip crosses the surface, more by its way along the needle than by its way across it: the tip
///   presses. Otherwise shaft or tip come from the side (side_contact.h), and push across the needle only.
/// touching → inserted: the tip's force has reached the capsule's puncture force. Before that an indentation δ takes at
///   most a₁δ + a₂δ²; the part that the tissue as a whole does not yield is the tip's local dent. δ is what the tip has
///   gone along the needle: how deep it comes to lie by sliding over the surface does not count.
/// inserted: the tip cuts at its cutting force; the shaft sticks up to its friction. A region with a capsule stops the
///   tip at its surface up to its own puncture force.
/// inserted → through: the tip's material point leaves through the far side; back again when the tip returns.
/// inserted → withdrawn: the tip is back at the entry and out; every landmark is released. Pushed in again at the same
///   place the needle follows its old cut, which takes friction only, until it is leave_path_mm beside it.
/// A pose that starts inside, or jumps, in place or in direction, reinitializes the contact: the needle is in the
/// tissue as if it had always been there, and carries no force until it moves.
///
/// Contact with the deformed surface is decided in the rest shape: tissue springs back to rest where it is
/// not held, and X + u(X) crosses the deformed surface exactly where the material point X crosses the surface at rest.
///
/// A tick is begin, which sets the landmarks' bounds, then the solve of all needles together
/// (contact_solve.h), then finish; or, where there is no solution, finish_unsolved.
/// A catheter with a course of its own (FollowedCourse) lies along it behind its tip: a shaft landmark follows its
/// nearest point and sticks and slips along its direction there. It is as stiff as the course is given, and does not
/// bend.
///
/// Limits: of a catheter on its course only the last kSideOfCourseMm touch from the side; a tip that leaves and enters
/// a second lobe stays `through`; a needle does not enter other needles' cuts, and stores kOldPaths of its own.
/// Threads: one. Real-time: no allocation after construction, no exceptions; a few BVH queries a call.
class NeedleContact {
 public:
  static constexpr std::size_t kOldPaths = 4;

  /// Of a catheter on its course, taken as straight where it touches from the side.
  static constexpr double kSideOfCourseMm = 10;

  /// `surface` (closed, outward, at rest) and `tissues` must outlive this. `guide_z_mm`: of NeedleBend. `course`: of
  /// FollowedCourse; empty: the needle is straight, or bends.
  NeedleContact(const SurfaceBvh& surface, const NeedleTissues& tissues, const NeedleSettings& needle,
                const ContactSettings& settings, std::optional<double> guide_z_mm = {},
                std::span<const Vec3> course = {});

  /// Starts a tick with its pose. `last_field` is the field of the last one: a new shaft landmark starts with its
  /// displacement. None: at rest. `frame`: where the body is; landmarks, axis and lines are in its frame B.
  void begin(const RigidTransform& X_WN, const DisplacementField* last_field,
             const BodyFrame& frame = {}) noexcept;
  /// Makes it a locking needle, which holds the gland by barbs (ContactSettings::locking_force_n).
  void lock() { is_locking_ = true; }
  /// Its side presses as one point, for models whose weights are no forces.
  void press_as_one_point() { side_.press_as_one_point(); }
  /// A tick without a pose: no landmarks; the contact stays as it is.
  void skip() noexcept;

  /// Shaft landmarks from the entry on, then the tip's, if it is in the tissue.
  std::span<NeedleLandmark> landmarks() { return outcome_.landmarks; }
  std::span<const NeedleLandmark> landmarks() const { return outcome_.landmarks; }
  bool has_tip_landmark() const { return outcome_.has_tip_landmark; }
  const Vec3& axis() const { return needle_.axis; }
  /// A direction across the needle, unit: that in which it pushes from the side, if it does.
  Vec3 lateral_direction() const { return is_beside() ? side_.direction() : needle_.axis.unitOrthogonal(); }
  /// How much of the hand's motion across the needle a landmark takes part in (NeedleBend::share_of_hand).
  double share_of_hand(const NeedleLandmark& landmark) const {
    return bend_ ? bend_->share_of_hand(landmark.arc_mm) : 1;
  }
  /// Whether a landmark's bounds are along the needle, not in the direction that it pushes from the side.
  bool is_along(const NeedleLandmark& landmark) const { return is_in() || landmark.axis == needle_.axis; }
  Vec3 nearest_on_line(const Vec3& p) const {
    return needle_.nearest(p).point;
  }  ///< the shaft's, without end

  /// After the slips are known: whether the tip reached the end of its old cut within this tick. Its landmark then gets
  /// the bounds for uncut tissue, and the tick must be solved again.
  bool reaches_uncut_tissue() noexcept;

  /// Ends a tick with the landmarks' reactions and slips: cuts, punctures, slips, forces. The stiffnesses are those
  /// of all landmarks together, stuck, N/mm.
  void finish(std::uint64_t tick, double period_s, double axial_stiffness, double lateral_stiffness) noexcept;

  /// Ends a tick whose landmarks have no solution. Nothing sticks, so that the needle goes on, in or out; it punctures
  /// no capsule. The last tick's force fades, e-fold in kUnsolvedFade seconds; the local model has that force alone.
  void finish_unsolved(std::uint64_t tick, double period_s) noexcept;
  static constexpr double kUnsolvedFade = 0.05;

  ContactState state() const { return state_; }
  double insertion_depth() const { return outcome_.insertion_depth; }  ///< mm, along the cut path
  double tip_depth() const { return outcome_.tip_depth; }              ///< mm, NeedleState::tip_depth_mm
  Vec3 material_tip() const {
    return cut_.path.at(cut_.tip_s);
  }                                                 ///< while in the tissue: the tip's material point, mm
  double tip_arc_mm() const { return cut_.tip_s; }  ///< of material_tip() on path()
  const CutPath& path() const {
    return cut_.path;
  }  ///< while in the tissue: what the needle has cut, at rest
  /// While it presses on the intact capsule: where, at rest.
  const Vec3& contact_point() const { return press_.point; }
  bool is_pressing() const { return state_ == ContactState::kTouching && press_.by_tip; }
  std::uint32_t puncture_count() const { return outcome_.puncture_count; }
  std::uint32_t flags() const { return outcome_.flags; }  ///< StepFlag bits of this tick
  const NeedleForces& forces() const { return outcome_.forces; }
  const LocalContactModel& local_model() const { return outcome_.local_model; }
  /// How the needle bends, after finish; null: it is rigid.
  const NeedleBend* bend() const { return bend_ ? &*bend_ : nullptr; }
  /// Where it lies along its course; null: it is straight, or bends.
  const FollowedCourse* course() const { return needle_.course.is_followed() ? &needle_.course : nullptr; }
  /// A direction of the body's frame in the world's, where the needle is.
  Vec3 direction_in_world(const Vec3& v) const { return body_.is_turned ? Vec3(body_.turn * v) : v; }

  /// Share of the outer capsule's puncture force that the needle carries, 0 … 1: the load of dynamic anchors.
  double load() const noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(state_, needle_, last_, body_, press_, side_, cut_, old_, bend_, outcome_);
  }

 private:
  struct Needle {  // this tick's pose in parts
    Vec3 hub = Vec3::Zero(), tip = Vec3::Zero(), axis = Vec3::UnitZ();
    Vec3 bent_tip = Vec3::Zero();  // by the last tick's forces
    // Of the line that it takes where nothing touches it:
    Vec3 free_hub = Vec3::Zero(), free_tip = Vec3::Zero();
    double moved = 0;  // since the last tick, the farther of tip and hub, mm
    FollowedCourse course;
    /// Of the shaft's line, without end, or of the course, and its direction there.
    FollowedCourse::Place nearest(const Vec3& p) const {
      if (course.is_followed()) return course.nearest(p);
      return {tip + (p - tip).dot(axis) * axis, axis};
    }
    /// The shaft's point at arc length s from the tip.
    Vec3 behind_tip(double s) const { return course.is_followed() ? course.point(s) : Vec3(tip - s * axis); }
    Vec3 across(const Vec3& v) const { return v - v.dot(axis) * axis; }
    template <class Archive>
    void list_state(Archive& archive) {
      archive(hub, tip, axis, bent_tip, free_hub, free_tip, moved, course);
    }
  };
  struct ShaftLandmark {
    Vec3 position;       // material point on the cut path
    double friction;     // N/mm
    double axial = 0;    // how far friction has carried it along the needle, mm
    bool slips = false;  // did in the last tick
    Vec3 relaxed_n = Vec3::Zero();

    template <class Archive>
    void list_state(Archive& archive) {
      archive(position, friction, axial, slips, relaxed_n);
    }
  };

  /// What is known of the tick before.
  struct LastTick {
    bool is_known = false;
    Vec3 tip = Vec3::Zero(), free_tip = Vec3::Zero();  // in the body's frame of this tick
    Vec3 world_tip = Vec3::Zero(), world_axis = Vec3::UnitZ();
    Vec3 slope = Vec3::Zero();  // of the bent tip, by its forces
    double slip = 0;            // of the tip, mm
    double tip_reaction_n = 0;  // along the needle, in uncut tissue

    template <class Archive>
    void list_state(Archive& archive) {
      archive(is_known, tip, free_tip, world_tip, world_axis, slope, slip, tip_reaction_n);
    }
  };
  /// Whether and how the body's frame is turned against the world's.
  struct BodyTurn {
    bool is_turned = false;
    bool is_moving = false;  // nor was it the world's in the last tick
    Mat3 turn = Mat3::Identity();

    template <class Archive>
    void list_state(Archive& archive) {
      archive(is_turned, is_moving, turn);
    }
  };
  /// Touching.
  struct Press {
    Vec3 point = Vec3::Zero();  // material, on the surface
    bool by_tip = false;        // the tip presses; otherwise the needle lies against the surface
    double advanced = 0;        // how far such a needle's tip has gone along it since, mm
    double not_pressed = 0;  // how much deeper the tip lies by sliding than by its way along the needle, mm
    double slid = 0;         // how far the tip has slid downhill, mm
    bool has_punctured = false;     // in the last tick
    Vec3 relaxed_n = Vec3::Zero();  // at the tip, or where it presses

    template <class Archive>
    void list_state(Archive& archive) {
      archive(point, by_tip, advanced, not_pressed, slid, has_punctured, relaxed_n);
    }
  };
  /// Inserted, through.
  struct Cut {
    CutPath path;
    double tip_s = 0;            // arc length of the tip's material point
    std::size_t tissue = 0;      // that the end of the path lies in
    std::size_t capsule_of = 0;  // the tissue whose capsule stops the path's end; 0: none
    double free_slip = 0;        // part of this tick's slip within the old cut
    std::vector<ShaftLandmark> shaft = {};

    template <class Archive>
    void list_state(Archive& archive) {
      archive(path, tip_s, tissue, capsule_of, free_slip, shaft);
    }
  };
  struct OldCuts {
    bool was_inserted = false;   // decides between free and withdrawn
    std::vector<CutPath> paths;  // kOldPaths, unused ones empty
    std::size_t next = 0;

    template <class Archive>
    void list_state(Archive& archive) {
      archive(was_inserted, paths, next);
    }
  };
  /// Of a tick.
  struct Outcome {
    std::vector<NeedleLandmark> landmarks;
    bool has_tip_landmark = false;
    double insertion_depth = 0, tip_depth = 0;
    std::uint32_t puncture_count = 0;
    std::uint32_t flags = 0;
    NeedleForces forces;
    LocalContactModel local_model;

    template <class Archive>
    void list_state(Archive& archive) {
      archive(landmarks, has_tip_landmark, insertion_depth, tip_depth, puncture_count, flags, forces,
              local_model);
    }
  };

  // geometry, before the solve
  void set_needle(const RigidTransform& X_WN, const RigidTransform& X_BN) noexcept;
  void lay_free_line() noexcept;
  void reinitialize() noexcept;
  std::size_t pieces() const noexcept;
  Vec3 end_of_piece(std::size_t piece) const noexcept;
  void approach() noexcept;
  CutPath* find_old_path(const Vec3& entry) noexcept;
  void enter_old_path(CutPath& old) noexcept;
  bool comes_along(const Vec3& normal) const noexcept;
  void press() noexcept;
  void press_beside() noexcept;
  bool is_inside() const noexcept;
  void enter() noexcept;
  void follow_path(const DisplacementField* last_field) noexcept;
  void set_shaft(const DisplacementField* last_field) noexcept;
  void release() noexcept;

  // landmarks
  double depth_of_tip() const noexcept;
  void add_contact() noexcept;
  void add_side() noexcept;
  double pressed_mm() const noexcept;
  const NeedleLandmark* pressing_landmark() const noexcept;
  void add_shaft(double motion) noexcept;
  void add_tip() noexcept;
  void add(const NeedleLandmark& landmark, double axial) noexcept;
  void set_tip_force() noexcept;
  void slide_downhill() noexcept;
  double resistance() const noexcept;
  double barbs_n_per_mm() const noexcept;
  double tributary(std::size_t landmark) const noexcept;

  // after the solve
  double pressing_reaction() const noexcept;
  void relax(double period_s) noexcept;
  void move_tip(double distance) noexcept;
  void cut(double distance) noexcept;
  double stop_at_capsule(const Vec3& from, const Vec3& to) noexcept;
  void sum_forces() noexcept;
  void add_guide() noexcept;
  void turn_to_world() noexcept;
  void update_local_model(std::uint64_t tick, double axial_stiffness, double lateral_stiffness) noexcept;
  double pushed_aslant_n() const noexcept;
  void add_capsule_ahead() noexcept;

  bool is_beside() const { return state_ == ContactState::kTouching && !press_.by_tip; }
  bool is_in() const { return state_ == ContactState::kInserted || state_ == ContactState::kThrough; }

  const SurfaceBvh& surface_;
  const NeedleTissues& tissues_;
  NeedleSettings needle_settings_;
  ContactSettings settings_;

  bool is_locking_ = false;
  ContactState state_ = ContactState::kFree;
  Needle needle_;  // in the body's frame
  LastTick last_;
  BodyTurn body_;
  Press press_;
  SideContact side_;  // where it does not press by its tip
  Cut cut_;
  OldCuts old_;
  std::optional<NeedleBend> bend_;  // of a flexible needle
  Outcome outcome_;
};

}  // namespace brachy
