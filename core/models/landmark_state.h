#pragma once

#include "core/base/state_archive.h"
#include "core/elasticity/beam.h"
#include "core/injectivity/certificate.h"
#include "core/kernels/landmark_spread.h"

/// The members of the plain structs that a field's state is made of, for StateWriter and StateReader. Each binding
/// names all of them, so that a new member does not compile until it is in its list.
namespace brachy {

template <class Archive>
void list_state(Archive& archive, LandmarkSpread& spread) {
  auto& [core_mm, stiffness_n_per_mm, axis, across_mm, behind] = spread;
  archive(core_mm, stiffness_n_per_mm, axis, across_mm, behind);
}

template <class Archive>
void list_state(Archive& archive, Beam& beam) {
  auto& [axis, length_mm, bending_stiffness_nmm2, hand_rad_per_nmm, guide_mm] = beam;
  archive(axis, length_mm, bending_stiffness_nmm2, hand_rad_per_nmm, guide_mm);
}

template <class Archive>
void list_state(Archive& archive, Certificate& certificate) {
  auto& [verdict, det_bound, vertex_det, place, margin_mm, substeps, held_mm, held_n, condition] =
      certificate;
  archive(verdict, det_bound, vertex_det, place, margin_mm, substeps, held_mm, held_n, condition);
}

}  // namespace brachy
