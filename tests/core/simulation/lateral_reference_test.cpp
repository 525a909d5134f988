// Touches from the side against CalculiX (tests/reference/lateral_touches).
#include <gtest/gtest.h>

#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/tissue/interior_points.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/simulation/phantom_scene.h"
#include "tests/reference_files.h"

namespace brachy {
namespace {

const Vec3 kFineSemiAxes(25, 20, 22.5);

// The gland's surface as in the reference: the phantom's vertices, moved onto an ellipsoid; so many that the surface
// between them is at most 0.03 mm inside it.
Tissue fine_ellipsoid() {
  SurfaceMesh surface = prostate_phantom(5000);
  for (Vec3& v : surface.vertices)
    v = kFineSemiAxes.cwiseProduct(v.cwiseQuotient(kFineSemiAxes).normalized());
  const SurfaceBvh bvh(surface);
  return build_tissue(surface, fill_interior(bvh, 500, 1, "the fine_ellipsoid"));
}

TEST(LateralReference, ForcesAreFiniteElements) {
  const NumberTable table = load_number_csv(
      test::kReferences / "lateral_touches" / "touches.csv",
      "case,tip_x_mm,tip_y_mm,tip_z_mm,axis_x,axis_y,axis_z,push_x,push_y,push_z,depth_mm,tip_past_mm,"
      "force_x_n,force_y_n,force_z_n,contact_from_mm,contact_to_mm,mesh_difference_percent");
  ASSERT_EQ(table.rows(), 10u);
  const auto model = load_simulation_model(Scene{}, fine_ellipsoid());
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const Vec3 tip = test::vector_at(table.row(i), 1), axis = test::vector_at(table.row(i), 4),
               push = test::vector_at(table.row(i), 7), truth = test::vector_at(table.row(i), 12);
    Simulator simulator(model);
    MeshState state = simulator.initial_state();
    for (const Vec3& at : test::straight(tip - 8 * push, tip, 0.1))
      simulator.step(test::needle_pose(test::pose_at(at, axis)), state);
    const Vec3 force = -state.needles.states[0].forces.force_n;  // on the tissue
    EXPECT_LT((force - truth).norm(), 0.1 * truth.norm()) << "case " << i + 1 << ": " << force.transpose();
  }
}

}  // namespace
}  // namespace brachy
