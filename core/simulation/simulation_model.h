#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "core/base/set_up.h"
#include "core/base/simd/simd_target.h"
#include "core/base/work_budget.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/brachytherapy/plan/template_grid.h"
#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/seeds/seed_settings.h"
#include "core/brachytherapy/structures/tested_organs.h"
#include "core/elasticity/elastic_body.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/tissue/tissue.h"
#include "core/injectivity/guard_settings.h"
#include "core/kernels/kernels.h"
#include "core/kernels/matrix_kernel.h"
#include "core/models/blended/tissue_kernels.h"
#include "core/needle/contact_settings.h"
#include "core/needle/needle_tissues.h"
#include "core/needle/probe_settings.h"
#include "core/simulation/body_motion.h"
#include "core/simulation/clinical_noise.h"
#include "core/solve/anchors.h"

namespace brachy {

struct SmoothTables;

/// A ψ kernel with the same support radius everywhere.
struct ScalarModel {
  Kernel kernel;
  double support_radius_mm = 12;
};

/// A matrix-valued kernel and the body that it was made for (make_matrix_kernel).
struct MatrixModel {
  std::shared_ptr<const MatrixKernel> kernel;
  ElasticBody body;
};

/// What deforms the tissue: one kernel everywhere, or one for each tissue, blended.
using DeformationModel =
    std::variant<ScalarModel, MatrixModel, TissueModel<ScalarKernels>, TissueModel<CompactKernels>>;

/// What else a simulation is made with. Lengths in mm.
struct SimulationSettings {
  double period_s = 1.0 / 200;  ///< of a tick, > 0
  SimdTarget target = best_simd_target();
  int threads = 1;  ///< OpenMP threads of the field evaluation
  /// What a tick may do: `is_whole` as WorkBudget's.
  struct Work {
    WorkCosts costs;
    bool is_whole = false;
  };
  Work work;
  /// Of tissue in no region: these set the stiffness of a landmark where the kernel itself knows no force.
  struct Softness {
    double shear_modulus_kpa = 6, poisson = 0.49;
  };
  Softness softness;
  /// not used by MatrixModel and CompactKernels, which model what supports the tissue
  Anchors::Options anchors;
  GuardSettings guard;
  NeedleSettings needle;
  ContactSettings contact;
  BodySettings body;
  NoiseSettings noise;
  ProbeSettings probe;
  TemplateGrid template_grid;
  SeedSettings seeds;
  /// Of needle n, the course that it follows (FollowedCourse), world frame W, mm; empty, or fewer than there are
  /// needles: it is straight, or bends.
  std::vector<std::vector<Vec3>> courses = {};
};

/// Everything about a simulation that does not change from tick to tick, as MuJoCo's mjModel; a Simulator has what
/// does. Made from memory: nothing in core/simulation reads a file (core/scene/load_simulation_model.h makes one of
/// a scene). Hold it as std::shared_ptr<const SimulationModel>: any number of simulators, on any threads, may share
/// one and the tables in it.
/// Threads: const functions and members from any.
struct SimulationModel {
  /// Takes up to some seconds with MatrixModel (smooth_tables).
  /// Errors: UserError where there are more anchors than surface vertices, or the tissue is not within
  /// MatrixModel's box.
  SimulationModel(Tissue tissue, DeformationModel deformation, NeedleTissues needle_tissues,
                  const SimulationSettings& settings = {}, std::optional<Plan> plan = {},
                  std::vector<TestedOrgan> organs = {}, std::vector<Seed> seeds_at_start = {},
                  const SetUp& set_up = {});

  std::size_t max_landmarks() const;  ///< of a tick: all needles', the probe's and the anchors
  /// Where the gland turns and swells about: its apex, the lowest point, on its axis.
  static Vec3 apex_of(const Tissue& tissue);
  /// World z of the template's plane where it holds the needles (needle.guide_at), mm.
  std::optional<double> guide_z_mm() const;
  /// Of one landmark alone (core/elasticity/landmark_stiffness.h).
  double landmark_stiffness_n_per_mm() const;
  /// What a tick of these settings may do.
  WorkBudget work_budget() const {
    return {.period_s = settings.period_s, .costs = settings.work.costs, .is_whole = settings.work.is_whole};
  }

  Tissue tissue;
  SurfaceBvh surface;  ///< the tissue's
  DeformationModel deformation;
  NeedleTissues needle_tissues;
  SimulationSettings settings;
  std::optional<Plan> plan;
  std::vector<TestedOrgan> organs;  ///< that needles are tested against
  /// In the body at the start, in every state's seeds. Those outside the tissue are fixed: they do not move with it.
  std::vector<Seed> seeds_at_start;
  /// Of MatrixModel's smooth part (core/models/matrix_kernel/smooth_tables.h), for settings.target; null where it has
  /// none, and for all other models.
  std::shared_ptr<const SmoothTables> smooth_tables;
  BodyMotion body_at_rest;
  Anchors anchors;  ///< at rest; none where the deformation model has the support of the tissue itself
  std::uint64_t digest = 0;  ///< for saved states (core/simulation/model_digest.h)
};

/// The anchors at rest in `tissue`. They stand in for what supports the tissue; there are none where the deformation
/// model has that itself (`models_support`). Errors: UserError where there are more of them than surface vertices.
Anchors make_anchors(const Tissue& tissue, Anchors::Options options, bool models_support);

}  // namespace brachy
