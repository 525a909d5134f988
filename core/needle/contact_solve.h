#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/models/landmark_set.h"
#include "core/models/tissue_field.h"
#include "core/needle/needle_contact.h"
#include "core/needle/probe_contact.h"
#include "core/needle/reaction_solver.h"

namespace brachy {

/// Stick and slip of all needles' landmarks at once: reactions of sticking landmarks, from the field's own landmark
/// system, and the slip of each (reaction_solver.h).
/// Threads: one. Real-time: no allocation after construction, no exceptions.
class ContactSolve {
 public:
  explicit ContactSolve(std::size_t max_landmarks, double period_s = 1.0 / 200);

  /// `landmarks` has the needles' landmarks where they would be if they stuck; on return, where they are, settled.
  /// Reactions and slips go to the needles, which then finish their tick. Sets the solver's StepFlag bits in `flags`.
  /// Unless it returns kOk, the needles go on without a solution (NeedleContact::finish_unsolved), nothing holds the
  /// probe, the field is as it was, and the landmarks are not settled. `probe`: null where there is none.
  FactorStatus solve(std::uint64_t tick, std::span<NeedleContact> needles, ProbeContact* probe,
                     LandmarkSet& landmarks, TissueField& field, std::uint32_t& flags) noexcept;
  /// Where the body goes under the last solve's reactions (LandmarkCompliance::body_motion).
  const Vec6& body_motion() const { return body_motion_; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(solver_, body_motion_);
  }

 private:
  FactorStatus factorize(LandmarkSet& landmarks, TissueField& field, std::uint32_t& flags) noexcept;
  void find_slips(std::span<NeedleContact> needles, ProbeContact* probe, LandmarkSet& landmarks,
                  TissueField& field, std::uint32_t& flags) noexcept;
  void find_stiffnesses(std::span<const NeedleContact> needles, const ProbeContact* probe,
                        const LandmarkSet& landmarks, TissueField& field) noexcept;
  void add_relaxed(LandmarkSet& landmarks) noexcept;

  ReactionSolver solver_;
  double period_s_;
  Eigen::MatrixXd stiffness_;
  std::vector<Vec3> axes_, reactions_;
  std::vector<double> along_, across_;  // stiffness of each instrument, N/mm
  /// The landmarks of each instrument that has some, which are moved together.
  struct Groups {
    std::vector<std::uint32_t> of;         // of each landmark, for the field
    std::vector<std::size_t> instruments;  // of each group …
    std::vector<Vec3> directions;          // … and where it is moved
    std::vector<Vec3> motions;             // of each landmark, by 1 mm of its group's
    std::vector<double> stiffnesses;       // N/mm
  };
  Groups groups_;
  std::vector<Vec3> relaxed_;           // of all landmarks, N
  std::vector<Vec3> yielded_;           // what needles and body have given back for it, mm
  std::vector<NeedleLandmark*> owned_;  // of landmarks behind the anchors
  std::vector<std::size_t> removed_;
  Vec6 body_motion_ = Vec6::Zero();
  /// Of the needles' landmarks, along their axes: reactions if they stuck, their bounds, N; slips, mm; reactions, N.
  struct Slip {
    std::vector<double> stuck, low, high, slips, axial;
  };
  Slip slip_;
};

}  // namespace brachy
