#pragma once

#include "core/brachytherapy/seeds/loading_plan.h"
#include "core/models/landmark_state.h"
#include "core/needle/needle_landmark.h"
#include "core/simulation/mesh_state.h"

/// As core/models/landmark_state.h, of the plain structs that the rest of a run's state is made of.
namespace brachy {

template <class Archive>
void list_state(Archive& archive, RigidTransform& transform) {
  auto& [R, p] = transform;
  archive(R, p);
}

template <class Archive>
void list_state(Archive& archive, NeedlePose& pose) {
  auto& [X_WN, sequence, stamp_ns, received_ns, button, load_number, load, present] = pose;
  archive(X_WN, sequence, stamp_ns, received_ns, button, load_number, load, present);
}

template <class Archive>
void list_state(Archive& archive, TickPose& pose) {
  auto& [tick, X_WN, button] = pose;
  archive(tick, X_WN, button);
}

template <class Archive>
void list_state(Archive& archive, NeedleShape& shape) {
  auto& [is_bent, points, tip_axis, tip_deflection] = shape;
  archive(is_bent, points, tip_axis, tip_deflection);
}

template <class Archive>
void list_state(Archive& archive, NeedleForces& forces) {
  auto& [force_n, guide_n, tip_torque_nmm, hub_torque_nmm, axial_n, lateral_n, cutting_n, friction_n] =
      forces;
  archive(force_n, guide_n, tip_torque_nmm, hub_torque_nmm, axial_n, lateral_n, cutting_n, friction_n);
}

template <class Archive>
void list_state(Archive& archive, LocalContactModel& model) {
  auto& [tick, in_contact, is_capsule, is_stuck, reference_tip, contact_point, axis, axial_stiffness,
         axial_min_n, axial_max_n, after_puncture_n, lateral_n, lateral_stiffness, time_to_live_s] = model;
  archive(tick, in_contact, is_capsule, is_stuck, reference_tip, contact_point, axis, axial_stiffness,
          axial_min_n, axial_max_n, after_puncture_n, lateral_n, lateral_stiffness, time_to_live_s);
}

template <class Archive>
void list_state(Archive& archive, DropCounts& counts) {
  auto& [dropped, refused, last_refusal] = counts;
  archive(dropped, refused, last_refusal);
}

template <class Archive>
void list_state(Archive& archive, NeedleState& state) {
  auto& [present, input, contact, X_WN, insertion_depth_mm, tip_depth_mm, landmark_count, puncture_count,
         forces, local_model, shape, drops] = state;
  archive(present, input, contact, X_WN, insertion_depth_mm, tip_depth_mm, landmark_count, puncture_count,
          forces, local_model, shape, drops);
}

template <class Archive>
void list_state(Archive& archive, NeedleLandmark& landmark) {
  auto& [position, axis, slides, if_stuck, low_n, high_n, friction_n, spread, relaxed_n, arc_mm, body,
         reaction_n, slip_mm, body_mm] = landmark;
  archive(position, axis, slides, if_stuck, low_n, high_n, friction_n, spread, relaxed_n, arc_mm, body,
          reaction_n, slip_mm, body_mm);
}

template <class Archive>
void list_state(Archive& archive, PlannedSeed& seed) {
  archive(seed.position, seed.axis, seed.source, seed.air_kerma_strength_u, seed.needle, seed.offset_mm);
}

template <class Archive>
void list_state(Archive& archive, LoadingPlan& plan) {
  auto& [seeds, first_of_needle, tips, is_withdrawn] = plan;
  archive(seeds, first_of_needle, tips, is_withdrawn);
}

template <class Archive>
void list_state(Archive& archive, Seed& seed) {
  auto& [id, tick, t_s, needle, is_certified, is_fixed, planned, source, air_kerma_strength_u, dropped,
         dropped_axis, rest, rest_axis, gland_motion, position, axis] = seed;
  archive(id, tick, t_s, needle, is_certified, is_fixed, planned, source, air_kerma_strength_u, dropped,
          dropped_axis, rest, rest_axis, gland_motion, position, axis);
}

template <class Archive>
void list_state(Archive& archive, FailedDrop& drop) {
  auto& [tick, t_s, needle, planned, why, at] = drop;
  archive(tick, t_s, needle, planned, why, at);
}

template <class Archive>
void list_state(Archive& archive, FailedDrops& drops) {
  auto& [count, slots] = drops;
  archive(count, slots);
}

template <class Archive>
void list_state(Archive& archive, OrganContact& contact) {
  auto& [is_in, passes, entered_tick, left_tick, entered_at, axis, depth_mm, time_s] = contact;
  archive(is_in, passes, entered_tick, left_tick, entered_at, axis, depth_mm, time_s);
}

}  // namespace brachy
