#include "core/simulation/simulation_model.h"

#include <gtest/gtest.h>

#include "core/elasticity/elastic_kernel.h"
#include "core/elasticity/wall_remainder.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/tissue/interior_points.h"
#include "core/geometry/tissue/phantom.h"
#include "core/simulation/simulator.h"
#include "core/simulation/state_hash.h"
#include "tests/core/simulation/phantom_scene.h"

namespace brachy {
namespace {

using test::insertion;
using test::needle_pose;

constexpr std::size_t kSurfaceVertices = 300, kPoints = 2000;

Tissue small_phantom() {
  const PreparedSurface prepared = prepare_surface(prostate_phantom(kSurfaceVertices), {}, "the phantom");
  return build_tissue(prepared.mesh, fill_interior(SurfaceBvh(prepared.mesh), kPoints - kSurfaceVertices, 1));
}

/// The remainder of the model `elastic`; counts how often it is evaluated.
class CountingRemainder : public Remainder {
 public:
  CountingRemainder(const ElasticBody& body, int& evaluations)
      : remainder_(body), evaluations_(evaluations) {}
  Parts between(const PointGroups& a, const PointGroups& b) const override {
    ++evaluations_;
    return remainder_.between(a, b);
  }
  Parts fields(std::span<const Vec3> X, const PointGroups& b, const Eigen::MatrixXd& forces) const override {
    ++evaluations_;
    return remainder_.fields(X, b, forces);
  }
  std::size_t bytes() const override { return remainder_.bytes(); }

 private:
  WallRemainder remainder_;
  int& evaluations_;
};

DeformationModel scalar_model() {
  return ScalarModel{*find_kernel("psi31"), 12};
}

DeformationModel elastic_model(int& remainder_evaluations) {
  const ElasticBody body;
  auto remainder = std::make_unique<const CountingRemainder>(body, remainder_evaluations);
  return MatrixModel{std::make_shared<const ElasticKernel>(body, std::move(remainder)), body};
}

DeformationModel elastic_model() {
  static int not_looked_at = 0;
  return elastic_model(not_looked_at);
}

/// A model built in memory: no scene, no file.
std::shared_ptr<const SimulationModel> model_from_memory(DeformationModel deformation = scalar_model()) {
  return std::make_shared<const SimulationModel>(
      small_phantom(), std::move(deformation),
      NeedleTissues(TissueContact{}, {}, NeedleSettings::kReferenceDiameter));
}

/// Steps a simulator through the insertion, some ticks at a time.
class InsertionRun {
 public:
  explicit InsertionRun(std::shared_ptr<const SimulationModel> model) : simulator_(std::move(model)) {}

  bool advance(std::size_t ticks) {
    for (; ticks > 0 && next_ < poses_.size(); --ticks) {
      simulator_.step(needle_pose(poses_[next_++]), state_);
      hash_.add(state_);
    }
    return next_ < poses_.size();
  }
  std::uint64_t hash() const { return hash_.value(); }
  double max_displacement_mm() const { return state_.summary.max_displacement_mm; }

 private:
  Simulator simulator_;
  MeshState state_ = simulator_.initial_state();
  std::vector<RigidTransform> poses_ = insertion();
  std::size_t next_ = 0;
  StateHash hash_;
};

std::uint64_t hash_of(std::shared_ptr<const SimulationModel> model) {
  InsertionRun run(std::move(model));
  while (run.advance(100)) {
  }
  return run.hash();
}

void expect_sharing_changes_nothing(DeformationModel (*deformation)()) {
  const std::shared_ptr<const SimulationModel> model = model_from_memory(deformation());
  InsertionRun first(model), second(model);
  first.advance(250);  // deep in the tissue while the second one is still at rest
  EXPECT_GT(first.max_displacement_mm(), 0.1);
  for (bool more = true; more;) {
    const bool first_goes_on = first.advance(7);
    more = second.advance(11) || first_goes_on;
  }
  const std::uint64_t alone = hash_of(model_from_memory(deformation()));
  EXPECT_EQ(first.hash(), alone);
  EXPECT_EQ(second.hash(), alone);
}

TEST(SimulationModel, TwoSimulatorsThatShareOneComputeWhatEachDoesWithItsOwn) {
  expect_sharing_changes_nothing(scalar_model);
}

TEST(SimulationModel, TwoSimulatorsThatShareAnElasticOneComputeWhatEachDoesWithItsOwn) {
  expect_sharing_changes_nothing(elastic_model);
}

TEST(SimulationModel, SimulatorsThatShareAnElasticOneReadItsTablesAndMakeNoneOfTheirOwn) {
  int evaluations = 0;
  const std::shared_ptr<const SimulationModel> model = model_from_memory(elastic_model(evaluations));
  ASSERT_NE(model->smooth_tables, nullptr);
  EXPECT_EQ(model->smooth_tables.use_count(), 1);
  const int for_the_model = evaluations;
  EXPECT_GT(for_the_model, 0);
  const Simulator first(model), second(model);
  EXPECT_EQ(evaluations, for_the_model);
  EXPECT_EQ(model->smooth_tables.use_count(), 3) << "the model and two simulators hold them";
}

TEST(SimulationModel, HasNoTablesWhereItsKernelHasNoSmoothPart) {
  EXPECT_EQ(model_from_memory()->smooth_tables, nullptr);
}

TEST(SimulationModel, FromMemoryComputesWhatThatOfTheSceneDoes) {
  Scene scene;
  scene.model.kernel = "psi31";
  scene.tissue.points = kPoints;
  scene.tissue.phantom_surface_vertices = kSurfaceVertices;
  EXPECT_EQ(hash_of(load_simulation_model(scene, load_tissue(scene).tissue)), hash_of(model_from_memory()));
}

}  // namespace
}  // namespace brachy
