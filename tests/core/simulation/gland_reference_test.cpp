// The probe and the gland on its ligaments against CalculiX (tests/reference/gland).
#include <gtest/gtest.h>

#include <fstream>
#include <iostream>
#include <sstream>

#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/tissue/interior_points.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/reference_files.h"

namespace brachy {
namespace {

const std::filesystem::path kGland = test::kReferences / "gland";
const Vec3 kSemiAxes(25, 20, 22.5);
constexpr double kAtMost = 0.10;  // relative, of forces and of displacements' L2

// The gland's surface as in the reference: the phantom's vertices, moved onto an ellipsoid.
Tissue ellipsoid() {
  SurfaceMesh surface = prostate_phantom(1200);
  for (Vec3& v : surface.vertices) v = kSemiAxes.cwiseProduct(v.cwiseQuotient(kSemiAxes).normalized());
  const SurfaceBvh bvh(surface);
  return build_tissue(surface, fill_interior(bvh, 800, 1, "the ellipsoid"));
}

Scene scene_of_reference() {
  Scene scene;
  scene.tissue.points = 2000;
  scene.tissue.contact.puncture_force_n = 100;
  return scene;
}

double error_at(Simulator& simulator, const NumberTable& table, std::size_t column) {
  double off = 0, all = 0;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const Vec3 X = test::vector_at(table.row(i), 0), truth = test::vector_at(table.row(i), column);
    const Vec3 u = MovedField(simulator.field(), simulator.body_frame()).displacement_at(X);
    off += (u - truth).squaredNorm();
    all += truth.squaredNorm();
  }
  return std::sqrt(off / all);
}

double level(const char* scene, double level_mm, std::size_t column) {
  std::ifstream file(kGland / "levels.csv");
  for (std::string line; std::getline(file, line);) {
    std::istringstream cells(line);
    std::vector<std::string> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    if (row.at(0) == scene && std::stod(row.at(1)) == level_mm) return std::stod(row.at(column));
  }
  ADD_FAILURE() << "levels.csv has no " << scene << " at " << level_mm;
  return 1;
}

TEST(GlandReference, TheProbeDentsItAsFiniteElementsSay) {
  Scene scene = scene_of_reference();
  scene.probe.on = true;
  scene.probe.surroundings_n_per_mm = 0;
  scene.probe.length_mm = 300;
  Simulator simulator(load_simulation_model(scene, ellipsoid()));
  MeshState state = simulator.initial_state();
  std::vector<NeedlePose> poses(scene.instrument_count());
  const double radius = 0.5 * scene.probe.diameter_mm + scene.probe.rectal_wall_mm;
  const NumberTable table = load_number_csv(kGland / "probe.csv", "x,y,z,dx3,dy3,dz3,dx6,dy6,dz6");
  double depth = -0.2;
  for (const double target : {3.0, 6.0}) {
    for (; depth < target + 1e-9; depth += 0.1) {
      poses.back() = test::needle_pose(
          test::pose_at({0, -kSemiAxes.y() - radius + std::min(depth, target), 100}, Vec3::UnitZ()));
      simulator.step(poses, state);
    }
    for (int settle = 0; settle < 20; ++settle) simulator.step(poses, state);
    const double force = -state.needles.states.back().forces.force_n.y(), truth = level("probe", target, 2);
    const double error = error_at(simulator, table, target == 3.0 ? 3 : 6);
    std::cout << "probe " << target << " mm: " << force << " N for " << truth << ", field off by "
              << 100 * error << " %\n";
    EXPECT_NEAR(force, truth, kAtMost * truth) << target;
    EXPECT_LT(error, kAtMost) << target;
  }
}

TEST(GlandReference, ANeedleMovesItOnItsLigamentsAsFiniteElementsSay) {
  Scene scene = scene_of_reference();
  scene.gland.moves = true;
  Simulator simulator(load_simulation_model(scene, ellipsoid()));
  MeshState state = simulator.initial_state();
  const double truth = level("motion", 6, 2);
  for (double z = -25; z < 30 && state.needles.states[0].forces.axial_n < truth; z += 0.02)
    simulator.step(test::needle_pose(test::pose_at({0, 0, z}, Vec3::UnitZ())), state);
  ASSERT_NEAR(state.needles.states[0].forces.axial_n, truth, 0.02 * truth);
  const NumberTable table = load_number_csv(kGland / "motion.csv", "x,y,z,dx6,dy6,dz6");
  const double error = error_at(simulator, table, 3);
  std::cout << "motion: field off by " << 100 * error << " %\n";
  EXPECT_LT(error, kAtMost);
}

}  // namespace
}  // namespace brachy
