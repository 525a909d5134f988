#include <gtest/gtest.h>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/tissue/interior_points.h"
#include "core/geometry/tissue/tissue.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

using namespace test;

PreparedSurface load(const std::filesystem::path& path, const SurfaceOptions& options = {}) {
  return prepare_surface(read_mesh_file(path), options, path.string());
}

TEST(RealMeshes, ProstateFromMrIsOneClosedComponent) {
  BRACHY_REQUIRE_DATA(data);
  const PreparedSurface gland = load(data / "meshes/prostate_mr.ply");
  EXPECT_EQ(gland.report.vertices, 52'769u);
  EXPECT_EQ(gland.report.triangles, 105'534u);
  EXPECT_EQ(gland.report.components, 1u);
  EXPECT_TRUE(gland.report.watertight);
  EXPECT_NEAR(gland.report.volume_cc, 19.32, 0.01);
  EXPECT_NO_THROW(require_closed(gland.report, "gland"));
  const Tissue tissue = build_tissue(gland.mesh, fill_interior(SurfaceBvh(gland.mesh), 60'000 - 52'769, 1));
  EXPECT_EQ(tissue.size(), 60'000u);
}

TEST(RealMeshes, FourDebrisIslandsAreDropped) {
  BRACHY_REQUIRE_DATA(data);
  const SurfaceReport gland = load(data / "meshes/prostate_with_debris.stl").report;
  EXPECT_EQ(gland.dropped_islands, 4u);
  EXPECT_LT(gland.dropped_island_volume_cc, 1e-6);
  EXPECT_EQ(gland.components, 1u);
  EXPECT_EQ(gland.vertices, 4'028u);
  EXPECT_TRUE(gland.watertight);
  EXPECT_NEAR(gland.volume_cc, 26.33, 0.01);
  const SurfaceReport all = load(data / "meshes/prostate_with_debris.stl", {.min_island_share = 0}).report;
  EXPECT_EQ(all.vertices, 4'052u);  // the published count is the islands' 6 × 4 more
  EXPECT_EQ(all.components, 5u);
}

TEST(RealMeshes, LiverAndInplaneTissueAreClosed) {
  BRACHY_REQUIRE_DATA(data);
  const SurfaceReport liver = load(data / "meshes/liver_concave.ply").report;
  EXPECT_EQ(liver.vertices, 2'002u);
  EXPECT_TRUE(liver.watertight);
  const SurfaceReport inplane = load(data / "meshes/inplane_tissue.stl").report;
  EXPECT_EQ(inplane.vertices, 782u);
  EXPECT_TRUE(inplane.watertight);
}

TEST(RealMeshes, EveryBadFileLoadsOrIsRefusedInOneLine) {
  BRACHY_REQUIRE_DATA(data);
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(data / "meshes/bad")) {
    ++files;
    try {
      const PreparedSurface surface = load(entry.path());
      require_closed(surface.report, entry.path().string());
      EXPECT_EQ(fill_interior(SurfaceBvh(surface.mesh), 100, 1).size(), 100u) << entry.path();
    } catch (const UserError& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find(entry.path().string()), 0u) << error.what();
    }
  }
  EXPECT_GE(files, 6u);
}

TEST(RealMeshes, EachBadFileIsJudgedForWhatItIs) {
  BRACHY_REQUIRE_DATA(data);
  const auto bad = data / "meshes/bad";
  EXPECT_TRUE(load(bad / "featuretype.STL").report.watertight);
  const SurfaceReport bodies = load(bad / "multibody.stl").report;
  EXPECT_EQ(bodies.components, 2u);
  EXPECT_TRUE(bodies.watertight);
  EXPECT_GT(bodies.flipped_triangles, 0u);
  EXPECT_EQ(load(bad / "not_convex.obj").report.nonmanifold_edges, 12u);
  const SurfaceReport soup = load(bad / "soup.stl").report;
  EXPECT_EQ(soup.components, 100u);
  EXPECT_EQ(soup.open_edges, 300u);
  EXPECT_NE(user_error([&] { load(bad / "stl_empty_bin.stl"); }).find("0 triangles"), std::string::npos);
  EXPECT_EQ(load(bad / "notenoughindices.obj").report.open_edges, 3u);
}

}  // namespace
}  // namespace brachy
