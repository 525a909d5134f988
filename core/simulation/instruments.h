#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/brachytherapy/structures/bone_stop.h"
#include "core/needle/needle_contact.h"
#include "core/needle/probe_contact.h"
#include "core/simulation/clinical_noise.h"
#include "core/simulation/mesh_state.h"
#include "core/simulation/simulation_model.h"

namespace brachy {

/// The scene's needles, by id, and its probe after them, if it has one: from their poses to contacts, and from solved
/// contacts to what a tick tells of each of them.
/// Threads: one. Real-time: no allocation after construction, no exceptions.
class Instruments {
 public:
  /// `model` must outlive this. `knows_forces`: TissueField::knows_forces of the field that solves the contacts.
  Instruments(const SimulationModel& model, bool knows_forces);

  /// Begins the contacts of tick `tick` at `poses`, by id (not present, or fewer than there are instruments: none),
  /// each as the hand really holds it (ClinicalNoise) and bone lets it (BoneStop). `last_field`, `frame`: the last
  /// tick's, as NeedleContact::begin. Returns the contacts' StepFlag bits.
  std::uint32_t begin(std::uint64_t tick, std::span<const NeedlePose> poses,
                      const DisplacementField& last_field, const BodyFrame& frame) noexcept;
  /// In place of begin, in a tick that leaves contacts and forces as they are: it only takes the poses.
  void hold(std::uint64_t tick, std::span<const NeedlePose> poses) noexcept;
  /// After the contacts are solved: where each needle that bends, or follows a course, lies. Returns the StepFlag bits
  /// of these, of which kStepSteep is known once the forces are.
  std::uint32_t find_shapes() noexcept;
  /// Writes what is told of each of them after tick `tick`, and its poses of the ticks after `since`, to `told`.
  void write(std::uint64_t since, std::uint64_t tick, NeedleStates& told) noexcept;

  std::span<NeedleContact> needles() { return needles_; }
  std::span<const NeedleContact> needles() const { return needles_; }
  ProbeContact* probe() { return probe_ ? &*probe_ : nullptr; }  ///< null: the scene has none
  const ProbeContact* probe() const { return probe_ ? &*probe_ : nullptr; }
  std::uint64_t punctures() const noexcept;  ///< of all needles, since the start
  bool is_in_tissue(std::size_t needle) const noexcept;
  bool is_stopped_by_bone(std::size_t needle) const { return bone_stops_[needle].is_stopped(); }
  const ClinicalNoise& noise() const { return noise_; }

  /// Of needles, then of the probe. Contacts and forces in them are those of the last write.
  std::span<NeedleState> states() { return states_; }
  std::span<const NeedleState> states() const { return states_; }
  const std::vector<NeedleStates::PoseHistory>& pose_histories() const { return pose_histories_; }

  /// Takes over the poses and the counts of drops of `other`, which is of the same scene.
  void resume_from(const Instruments& other) noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(needles_, bone_stops_, probe_, noise_, states_, pose_histories_);
  }

 private:
  void begin_needle(std::size_t n, const NeedlePose& pose, double t_s, const DisplacementField& last_field,
                    const BodyFrame& frame) noexcept;
  void begin_probe(const NeedlePose& pose, const DisplacementField& last_field,
                   const BodyFrame& frame) noexcept;
  void take_pose(std::size_t instrument, const NeedlePose& pose, std::uint64_t tick) noexcept;
  void skip(std::size_t instrument) noexcept;
  void lay_along(std::size_t n, const FollowedCourse& course) noexcept;
  void tell_needle(std::size_t n) noexcept;
  void tell_probe() noexcept;

  double period_s_, length_mm_;
  std::vector<NeedleContact> needles_;
  std::vector<BoneStop> bone_stops_;  // by needle
  std::optional<ProbeContact> probe_;
  ClinicalNoise noise_;
  std::vector<NeedleState> states_;
  std::vector<NeedleStates::PoseHistory> pose_histories_;
};

}  // namespace brachy
