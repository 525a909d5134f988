#include <gtest/gtest.h>

#include <numbers>

#include "core/base/error.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/tissue/phantom.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"
#include "core/scene/load_structures.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

/// The least signed distance of a's vertices to b, mm: negative where one lies inside.
double clearance(const SurfaceMesh& a, const SurfaceMesh& b) {
  const SurfaceBvh surface(b);
  double least = 1e300;
  for (const Vec3& v : a.vertices) least = std::min(least, surface.closest_point(v).signed_distance);
  return least;
}

TEST(PhantomStructures, AreClosedAndOutwardWithTheirTubesVolumes) {
  const struct {
    SurfaceMesh mesh;
    double radius, length;
  } all[] = {{phantom_urethra(), 3, 51.9}, {phantom_rectum(), 13.5, 75}};
  for (const auto& tube : all) {
    const SurfaceReport report = prepare_surface(tube.mesh, {}, "tube").report;
    EXPECT_TRUE(report.watertight);
    EXPECT_EQ(report.components, 1u);
    EXPECT_EQ(report.flipped_triangles, 0u);
    EXPECT_EQ(report.degenerate_triangles + report.duplicate_triangles + report.welded_vertices, 0u);
    EXPECT_NEAR(1e3 * report.volume_cc / (std::numbers::pi * tube.radius * tube.radius * tube.length), 1,
                0.015);
  }
}

TEST(PhantomStructures, TheUrethraGoesThroughTheGlandFromBaseToApex) {
  const SurfaceBvh gland(prostate_phantom());
  std::size_t inside = 0;
  for (const Vec3& v : phantom_urethra().vertices) {
    const double distance = gland.closest_point(v).signed_distance;
    if (std::abs(v.z()) < 17) {
      EXPECT_LT(distance, -4) << v.transpose();
      ++inside;
    }
  }
  EXPECT_GT(inside, 300u);
  // And comes out at both ends, by no more than a few millimetres.
  const SurfaceBvh urethra(phantom_urethra());
  for (const Vec3& end : {Vec3(0, -0.4, -22.5), Vec3(0, 1.6, 21.4)}) {
    EXPECT_NEAR(gland.closest_point(end).signed_distance, 0, 1);
    EXPECT_TRUE(urethra.inside(end));
  }
  EXPECT_NEAR(urethra.min().z(), -25.5, 1.5);
  EXPECT_NEAR(urethra.max().z(), 24.5, 1.5);
}

TEST(PhantomStructures, TheRectumRunsBehindTheGlandWithoutTouchingIt) {
  const double gap = std::min(clearance(phantom_rectum(), prostate_phantom(20000)),
                              clearance(prostate_phantom(20000), phantom_rectum()));
  EXPECT_GT(gap, 3);
  EXPECT_LT(gap, 5);
  EXPECT_GT(clearance(phantom_urethra(), phantom_rectum()), 10);
  const SurfaceBvh rectum(phantom_rectum());
  EXPECT_LT(rectum.min().z(), -30);
  EXPECT_GT(rectum.max().z(), 30);
  EXPECT_LT(rectum.max().y(), -20);
}

TEST(LoadStructures, ThePhantomBringsItsOwnStretchedAsItself) {
  const Scene scene = parse_scene("[tissue]\nphantom_size_mm = [25, 60, 45]", "scene.toml");
  const auto all = load_structures(scene);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].name, "prostate");
  EXPECT_EQ(all[1].name, "urethra");
  EXPECT_EQ(all[2].name, "rectum");
  EXPECT_EQ(find_structure(all, "rectum"), &all[2]);
  EXPECT_EQ(find_structure(all, "bladder"), nullptr);
  EXPECT_NEAR(SurfaceBvh(all[0].mesh).max().y(), 30, 1e-6);
  const SurfaceBvh rectum(all[2].mesh), as_made(phantom_rectum());
  EXPECT_NEAR(rectum.max().x(), 0.5 * as_made.max().x(), 1e-6);
  EXPECT_NEAR(rectum.min().y(), 1.5 * as_made.min().y(), 1e-6);
  EXPECT_NEAR(rectum.max().z(), as_made.max().z(), 1e-6);
}

TEST(LoadStructures, AScenesOwnTakeThePhantomsPlaceAndAMeshHasOnlyThose) {
  const TempFile box("box.stl", binary_stl(make_box({-1, -1, -1}, {1, 1, 1})));
  const std::string structure = "[[structure]]\nname = \"urethra\"\nfile = \"" + box.path().string() + "\"\n";
  const auto with_phantom = load_structures(parse_scene(structure, "scene.toml"));
  ASSERT_EQ(with_phantom.size(), 3u);
  EXPECT_EQ(with_phantom[1].name, "rectum");
  EXPECT_EQ(with_phantom[2].name, "urethra");
  EXPECT_EQ(with_phantom[2].mesh.vertices.size(), 8u);
  const auto with_mesh = load_structures(
      parse_scene("[tissue]\nmesh = \"" + box.path().string() + "\"\n" + structure, "scene.toml"));
  ASSERT_EQ(with_mesh.size(), 2u);
  EXPECT_EQ(with_mesh[0].name, "prostate");
  EXPECT_EQ(with_mesh[0].mesh.vertices.size(), 8u);
}

TEST(LoadStructures, AStructureNamedProstateIsTheGlandApartFromTheTissue) {
  const TempFile box("box.stl", binary_stl(make_box({-1, -1, -1}, {1, 1, 1})));
  const auto all = load_structures(parse_scene(
      "[[structure]]\nname = \"prostate\"\nfile = \"" + box.path().string() + "\"\n", "scene.toml"));
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].name, "prostate");
  EXPECT_EQ(all[0].mesh.vertices.size(), 8u);
  EXPECT_EQ(all[1].name, "urethra");
  EXPECT_EQ(all[2].name, "rectum");
}

TEST(LoadStructures, AStructureThatIsNotClosedIsRefusedWithTheScenesLine) {
  SurfaceMesh open = make_box({-1, -1, -1}, {1, 1, 1});
  open.triangles.pop_back();
  const TempFile file("open.stl", binary_stl(open));
  const Scene scene = parse_scene(
      "\n[[structure]]\nname = \"urethra\"\nfile = \"" + file.path().string() + "\"\n", "scene.toml");
  const std::string message = user_error([&] { load_structures(scene); });
  EXPECT_EQ(message.find("scene.toml:2: structure \"urethra\": " + file.path().string()), 0u) << message;
  const Scene missing = parse_scene("[[structure]]\nname = \"u\"\nfile = \"none.stl\"\n", "scene.toml");
  EXPECT_EQ(user_error([&] { load_structures(missing); }).find("scene.toml:1: structure \"u\": "), 0u);
}

std::string structure_text(const std::string& name, const std::filesystem::path& file,
                           const std::string& more = "") {
  return "[[structure]]\nname = \"" + name + "\"\nfile = \"" + file.string() + "\"\n" + more;
}

TEST(LoadStructures, FrameAndUnitsAreThoseOfEveryMeshOfTheScene) {
  // A gland and what lies left, behind and above it, in metres and LPS: x to the left, y backwards.
  const TempFile gland("gland.stl", binary_stl(make_box({-0.02, -0.02, -0.02}, {0.02, 0.02, 0.02})));
  const TempFile organ("organ.stl", binary_stl(make_box({0.03, 0.04, 0.05}, {0.04, 0.06, 0.08})));
  const std::string region =
      "[[region]]\nshape = \"mesh\"\nfile = \"" + gland.path().string() + "\"\nshear_modulus_kpa = 9\n";
  const Scene scene =
      parse_scene("[tissue]\nmesh = \"" + gland.path().string() + "\"\nframe = \"LPS\"\nunits = \"m\"\n" +
                      region + structure_text("rectum", organ.path()),
                  "scene.toml");
  const auto all = load_structures(scene);
  ASSERT_EQ(all.size(), 2u);
  const SurfaceBvh rectum(all[1].mesh);
  EXPECT_LT((rectum.min() - Vec3(-40, -60, 50)).norm(), 1e-4);
  EXPECT_LT((rectum.max() - Vec3(-30, -40, 80)).norm(), 1e-4);
  EXPECT_NEAR(SurfaceBvh(all[0].mesh).max().x(), 20, 1e-4);
  EXPECT_NEAR(SurfaceBvh(load_region_mesh(scene, scene.regions.front())).max().x(), 20, 1e-4);
}

TEST(LoadStructures, AMeshThatStatesItsFrameIsInThatWhateverTheSceneSays) {
  const SurfaceMesh box = make_box({30, 40, 50}, {40, 60, 80});
  std::string lps = binary_stl(box), ras = lps;
  lps.replace(0, 31, "3D Slicer output. SPACE=LPS    ");
  ras.replace(0, 31, "3D Slicer output. SPACE=RAS    ");
  const TempFile as_lps("lps.stl", lps), as_ras("ras.stl", ras);
  for (const char* frame : {"LPS", "RAS"}) {
    const auto all = load_structures(parse_scene(std::string("[tissue]\nframe = \"") + frame + "\"\n" +
                                                     structure_text("bladder", as_lps.path()) +
                                                     structure_text("bowel", as_ras.path()),
                                                 "scene.toml"));
    EXPECT_LT((SurfaceBvh(find_structure(all, "bladder")->mesh).min() - Vec3(-40, -60, 50)).norm(), 1e-4);
    EXPECT_LT((SurfaceBvh(find_structure(all, "bowel")->mesh).min() - Vec3(30, 40, 50)).norm(), 1e-4);
  }
}

TEST(LoadStructures, AStructureIsKnownByTheRoleOfItsName) {
  const TempFile box("box.stl", binary_stl(make_box({-1, -1, -1}, {1, 1, 1})));
  const Scene scene =
      parse_scene(structure_text("Rectum_PRV", box.path()) + structure_text("Urethra_Prostatc", box.path()) +
                      structure_text("Ampulle", box.path(), "role = \"rectum\"\n") +
                      structure_text("Bladder_Wall", box.path()) + structure_text("Harnblase", box.path()) +
                      structure_text("urethra", box.path(), "role = \"other\"\n") +
                      "[[goal]]\nstructure = \"Ampulle\"\nfigure = \"D2cc\"\nlimit = 90\n",
                  "scene.toml");
  const auto all = load_structures(scene);
  std::string names;
  for (const Structure& s : all) names += s.name + "=" + s.label + " ";
  EXPECT_EQ(names,
            "prostate= Rectum_PRV= urethra=Urethra_Prostatc rectum=Ampulle Bladder_Wall= bladder=Harnblase "
            "urethra_other=urethra ");
  EXPECT_EQ(find_structure(all, "Harnblase"), find_structure(all, "bladder"));
  EXPECT_EQ(find_structure(all, "rectum")->role, StructureRole::kRectum);
  EXPECT_EQ(scene.goals.front().structure, "rectum");
}

TEST(LoadStructures, TwoStructuresThatMayBeOneOrganAreRefusedWithBoth) {
  const std::string two = structure_text("Rektum", "a.stl") + structure_text("Enddarm", "b.stl");
  const std::string message = user_error([&] { parse_scene(two, "scene.toml"); });
  EXPECT_EQ(message,
            "scene.toml:4: \"Rektum\", \"Enddarm\" may each be the rectum; give one role = \"rectum\", and "
            "the other "
            "role = \"other\"");
  EXPECT_NO_THROW(parse_scene(two + "role = \"rectum\"\n", "scene.toml"));
  EXPECT_NO_THROW(parse_scene(two + "role = \"other\"\n", "scene.toml"));
  // Parts are no organ, and so no contradiction.
  EXPECT_NO_THROW(parse_scene(structure_text("Rectum_Ant", "a.stl") + structure_text("Rectum_Post", "b.stl"),
                              "scene.toml"));
}

}  // namespace
}  // namespace brachy
