#include "core/simulation/model_digest.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <typeinfo>

#include "core/base/state_archive.h"
#include "core/simulation/simulation_model.h"

namespace brachy {

// The settings, for StateWriter. Each binding names all members, so that a new one does not compile until it is listed.

template <class Archive>
void list_state(Archive& archive, const NeedleSettings& needle) {
  const auto& [length_mm, diameter_mm, count, flexible, youngs_modulus_gpa, inner_diameter_mm,
               hand_nmm_per_deg, bevel_force_share, locking_count, bevel_deg, guide_at] = needle;
  archive(length_mm, diameter_mm, count, flexible, youngs_modulus_gpa, inner_diameter_mm, hand_nmm_per_deg,
          bevel_force_share, locking_count, bevel_deg, guide_at);
}

template <class Archive>
void list_state(Archive& archive, const TissueContact& contact) {
  const auto& [puncture_force_n, capsule_n_per_mm, capsule_n_per_mm2, cutting_force_n, friction_n_per_mm] =
      contact;
  archive(puncture_force_n, capsule_n_per_mm, capsule_n_per_mm2, cutting_force_n, friction_n_per_mm);
}

template <class Archive>
void list_state(Archive& archive, const ContactSettings& contact) {
  const auto& [tip_core_mm, surface_slip_mm, landmark_spacing_mm, leave_path_mm, max_displacement_mm,
               max_jump_mm, relaxation_share, relaxation_s, locking_force_n, bone_n_per_mm, max_landmarks] =
      contact;
  archive(tip_core_mm, surface_slip_mm, landmark_spacing_mm, leave_path_mm, max_displacement_mm, max_jump_mm,
          relaxation_share, relaxation_s, locking_force_n, bone_n_per_mm, max_landmarks);
}

template <class Archive>
void list_state(Archive& archive, const Anchors::Options& anchors) {
  const auto& [count, lambda_rest, lambda_loaded, relaxation_s, clearance_mm, seed] = anchors;
  archive(count, lambda_rest, lambda_loaded, relaxation_s, clearance_mm, seed);
}

template <class Archive>
void list_state(Archive& archive, const GuardSettings& guard) {
  const auto& [policy, max_substeps] = guard;
  archive(policy, max_substeps);
}

template <class Archive>
void list_state(Archive& archive, const GlandSettings& gland) {
  const auto& [moves, stiffness_n_per_mm, rotation_nmm_per_deg] = gland;
  archive(moves, stiffness_n_per_mm, rotation_nmm_per_deg);
}

template <class Archive>
void list_state(Archive& archive, const SwellingSettings& swelling) {
  const auto& [on, build_up_s] = swelling;
  archive(on, build_up_s);
}

template <class Archive>
void list_state(Archive& archive, const NoiseSettings& noise) {
  const auto& [on, seed, template_play_mm, tremor_mm, drift_mm, stop_s, drop_along_mm, drop_across_mm,
               migration_along_mm] = noise;
  archive(on, seed, template_play_mm, tremor_mm, drift_mm, stop_s, drop_along_mm, drop_across_mm,
          migration_along_mm);
}

template <class Archive>
void list_state(Archive& archive, const ProbeSettings& probe) {
  const auto& [on, diameter_mm, length_mm, rectal_wall_mm, surroundings_n_per_mm, landmark_spacing_mm] =
      probe;
  archive(on, diameter_mm, length_mm, rectal_wall_mm, surroundings_n_per_mm, landmark_spacing_mm);
}

template <class Archive>
void list_state(Archive& archive, const TemplateGrid& grid) {
  // What holes are called changes no run.
  const auto& [columns, rows, spacing_mm, origin_mm, letters_from, half_steps] = grid;
  archive(columns, rows, spacing_mm, origin_mm);
}

template <class Archive>
void list_state(Archive& archive, const SeedSettings& seeds) {
  const auto& [applicator, source, air_kerma_strength_u, max_count, loading] = seeds;
  archive(applicator, source, air_kerma_strength_u, max_count, loading);
}

template <class Archive>
void list_state(Archive& archive, const WorkCosts& costs) {
  const auto& [system_s, landmark_s, landmark_pair_s, step_s, certificate_pair_s, block_ring_steps_per_s] =
      costs;
  archive(system_s, landmark_s, landmark_pair_s, step_s, certificate_pair_s, block_ring_steps_per_s);
}

template <class Archive>
void list_state(Archive& archive, const SimulationSettings& settings) {
  const auto& [period_s, target, threads, work, softness, anchors, guard, needle, contact, body, noise, probe,
               template_grid, seeds, courses] = settings;
  archive(period_s, work.costs, work.is_whole, softness.shear_modulus_kpa, softness.poisson, anchors, guard,
          needle, contact, body.gland, body.swelling, noise, probe, template_grid, seeds, courses);
}

namespace {

constexpr int kSamples = 20;  // along each axis of the tissue's box
// A weight within a blend may differ in its last bits from machine to machine.
constexpr double kWeightSteps = 1000;

class ModelListing {
 public:
  ModelListing(StateWriter& writer, const Tissue& tissue) : writer_(writer) {
    Vec3 min = tissue.rest_vertices.front(), max = min;
    for (const Vec3& X : tissue.rest_vertices) {
      min = min.cwiseMin(X);
      max = max.cwiseMax(X);
    }
    for (int i = 0; i < kSamples; ++i)
      for (int j = 0; j < kSamples; ++j)
        for (int k = 0; k < kSamples; ++k)
          samples_.push_back(min + (Vec3(i, j, k).array() / (kSamples - 1) * (max - min).array()).matrix());
  }

  void operator()(const NeedleTissues& tissues) {
    for (const Vec3& X : samples_) writer_(tissues.at(X), tissues[tissues.at(X)]);
  }
  void operator()(const ScalarModel& model) { writer_(model.kernel.index(), model.support_radius_mm); }
  void operator()(const MatrixModel& model) {
    const ElasticBody& body = model.body;
    const MatrixKernel& kernel = *model.kernel;
    writer_(std::string(typeid(kernel).name()), body.box_centre, body.box_size, body.held, body.shear_modulus,
            body.poisson, body.needle_radius);
    for (const Vec3& X : samples_) writer_(body.relative_modulus(X));
  }
  void operator()(const TissueModel<ScalarKernels>& model) {
    writer_(model.kernels.psi.index(), model.kernels.supports);
    (*this)(model.membership);
  }
  void operator()(const TissueModel<CompactKernels>& model) {
    for (const CompactKernel& kernel : model.kernels.kernels)
      writer_(std::lround(kWeightSteps * kernel.support()),
              std::lround(kWeightSteps * kernel.value(Vec3::Zero())(0, 0)));
    (*this)(model.membership);
  }
  void operator()(const Membership& membership) {
    std::vector<double> weights(membership.tissues());
    for (const Vec3& X : samples_) {
      membership.shares(X, weights);
      for (const double weight : weights) writer_(std::lround(kWeightSteps * weight));
    }
  }

 private:
  StateWriter& writer_;
  std::vector<Vec3> samples_;
};

}  // namespace

std::uint64_t digest_of(const SimulationModel& model) {
  std::vector<std::byte> bytes;
  StateWriter writer(bytes);
  writer(model.settings, model.tissue.rest_vertices, model.tissue.surface_count);
  for (const TestedOrgan& organ : model.organs)
    writer(organ.name, organ.is_bone, organ.surface->mesh().vertices);
  ModelListing list(writer, model.tissue);
  list(model.needle_tissues);
  std::visit(list, model.deformation);
  std::uint64_t hash = 0xcbf29ce484222325ull;
  for (const std::byte byte : bytes) hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3ull;
  return hash;
}

}  // namespace brachy
