#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/scene/file/scene_file.h"
#include "core/scene/load_tissue.h"
#include "tests/apps/apps_testing.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

using namespace test;

// The files of a folder, sorted; not those of its folders.
std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.is_regular_file()) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::string scene_with_mesh(const std::string& mesh) {
  return "[tissue]\npoints = 5000\nmesh = \"" + mesh + "\"\n[anchors]\ncount = 1\n[server]\nport = 0\n";
}

// A report, or an error of one line; never a signal.
void expect_report_or_one_line(const Ended& ended) {
  if (ended.exit_code == 0)
    EXPECT_FALSE(ended.out.empty());
  else
    EXPECT_TRUE(refused_in_one_line(ended, {}));
}

TEST(Inspect, DescribesTheDefaultScene) {
  const Ended ended = run_brachy({"inspect", (kConfigFolder / "prostate.toml").string(), "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(ended.err, "");
  const auto json = json_of(ended);
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("surface_vertices"), 1200);
  EXPECT_EQ(json.at("points"), 14560);
  EXPECT_EQ(json.at("components"), 1);
  EXPECT_EQ(json.at("bad_edges"), 0);
  EXPECT_EQ(json.at("watertight"), true);
  EXPECT_EQ(json.at("bbox_mm"), nlohmann::json::parse("[[-25,-20,-22.5],[25,20,22.5]]"));
  EXPECT_GT(json.at("volume_cc").get<double>(), 20);
  EXPECT_LT(json.at("volume_cc").get<double>(), 60);
}

TEST(Inspect, ListsTheAnchorsAScenesSimulationHas) {
  const TempFolder folder;
  const auto anchors_of = [&](const std::string& scene) {
    return json_of(run_brachy({"inspect", scene, "--json"})).at("anchors_mm");
  };
  const std::string scene = folder.write("s.toml", small_scene());
  const auto anchors = anchors_of(scene);
  ASSERT_EQ(anchors.size(), 8u);
  // Each is a surface point, half way to the centroid.
  const Tissue tissue = load_tissue(load_scene(scene)).tissue;
  const std::vector<Vec3> surface(
      tissue.rest_vertices.begin(),
      tissue.rest_vertices.begin() + static_cast<std::ptrdiff_t>(tissue.surface_count));
  const Vec3 centroid =
      std::accumulate(surface.begin(), surface.end(), Vec3(0, 0, 0)) / static_cast<double>(surface.size());
  for (const auto& anchor : anchors) {
    const Vec3 on_surface = 2 * Vec3(anchor[0], anchor[1], anchor[2]) - centroid;
    EXPECT_TRUE(std::ranges::any_of(surface, [&](const Vec3& v) { return (v - on_surface).norm() < 1e-9; }))
        << anchor;
  }
  EXPECT_EQ(anchors_of(folder.write("three.toml", small_scene("[anchors]\ncount = 3\n"))).size(), 3u);
  // An elastic body is held by its box.
  EXPECT_EQ(anchors_of(folder.write("e.toml", small_scene("[model]\nkernel = \"compact_elastic\"\n"))).size(),
            0u);
  const std::string mesh = folder.write("o.stl", octahedron_stl(30));
  EXPECT_FALSE(json_of(run_brachy({"inspect", mesh, "--json"})).contains("anchors_mm"));
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"inspect", folder.write("many.toml", "[tissue]\npoints = 500\nmesh = \"o.stl\"\n")}),
      {"anchors.count is 8", "6 vertices"}));
}

TEST(Inspect, WritesTheSurfaceItDescribes) {
  const TempFolder folder;
  const std::string file = (folder / "gland.ply").string();
  ASSERT_TRUE(exited(run_brachy({"inspect", (kConfigFolder / "prostate.toml").string(), "--out", file}), 0));
  const auto json = json_of(run_brachy({"inspect", file, "--json"}));
  EXPECT_EQ(json.at("surface_vertices"), 1200);
  EXPECT_EQ(json.at("watertight"), true);
  EXPECT_EQ(json.at("flipped_triangles"), 0);
}

TEST(Inspect, DescribesAMeshInItsUnitsAndFrame) {
  const TempFolder folder;
  const std::string mesh = folder.write("o.stl", octahedron_stl(30));
  const auto mm = json_of(run_brachy({"inspect", mesh, "--json"}));
  ASSERT_FALSE(mm.is_discarded());
  EXPECT_EQ(mm.at("surface_vertices"), 6);
  EXPECT_EQ(mm.at("points"), 6);
  EXPECT_EQ(mm.at("triangles"), 8);
  EXPECT_EQ(mm.at("flipped_triangles"), 0);
  EXPECT_NEAR(mm.at("volume_cc").get<double>(), 36, 1e-3);  // 4/3 · 3³
  EXPECT_EQ(mm.at("bbox_mm"), nlohmann::json::parse("[[-30,-30,-30],[30,30,30]]"));

  const std::string shifted = folder.write(
      "p.obj",
      "v 0.001 0 0\nv 0.003 0 0\nv 0.001 0.004 0\nv 0.001 0 0.005\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto m = json_of(run_brachy({"inspect", shifted, "--units", "m", "--frame", "LPS", "--json"}));
  ASSERT_FALSE(m.is_discarded());
  const std::vector<std::vector<double>> box = {{-3, -4, 0}, {-1, 0, 5}};
  for (std::size_t end = 0; end < 2; ++end)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(m.at("bbox_mm")[end][k].get<double>(), box[end][k], 1e-6);
}

TEST(Inspect, ReportsAnOpenMeshWithItsBadEdges) {
  const TempFolder folder;
  const std::string open = folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  const auto json = json_of(run_brachy({"inspect", open, "--json"}));
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("watertight"), false);
  EXPECT_EQ(json.at("bad_edges"), 3);
  EXPECT_EQ(json.at("open_edges"), 3);
  const Ended text = run_brachy({"inspect", open});
  EXPECT_NE(text.out.find("3 bad edges"), std::string::npos) << text.out;
}

TEST(Inspect, RefusesWhatItCannotReadInOneLine) {
  const TempFolder folder;
  const auto inspect = [](const std::string& file) { return run_brachy({"inspect", file}); };
  EXPECT_TRUE(refused_in_one_line(inspect((folder / "none.stl").string()), {"none.stl"}));
  EXPECT_TRUE(refused_in_one_line(inspect((folder / "none.toml").string()), {"none.toml"}));
  EXPECT_TRUE(refused_in_one_line(inspect(folder.write("e.stl", "")), {"e.stl"}));
  EXPECT_TRUE(refused_in_one_line(inspect(folder.write("e.ply", "ply\n")), {"e.ply"}));
  EXPECT_TRUE(refused_in_one_line(inspect(folder.write("e.vtk", "# vtk\n")), {"e.vtk"}));
  const std::string whole = octahedron_stl(10);
  EXPECT_TRUE(
      refused_in_one_line(inspect(folder.write("cut.stl", whole.substr(0, whole.size() / 2))), {"cut.stl"}));
}

TEST(Inspect, EveryRealMeshIsWatertight) {
  BRACHY_REQUIRE_DATA(data);
  const auto meshes = files_in(data / "meshes");
  ASSERT_FALSE(meshes.empty());
  for (const auto& mesh : meshes) {
    SCOPED_TRACE(mesh.string());
    const Ended ended = run_brachy({"inspect", mesh.string(), "--json"});
    ASSERT_TRUE(exited(ended, 0));
    EXPECT_EQ(json_of(ended).at("bad_edges"), 0);
    EXPECT_GT(json_of(ended).at("volume_cc").get<double>(), 1);
  }
}

TEST(Inspect, NoBadMeshCrashesIt) {
  BRACHY_REQUIRE_DATA(data);
  const auto meshes = files_in(data / "meshes" / "bad");
  ASSERT_FALSE(meshes.empty());
  for (const auto& mesh : meshes) {
    SCOPED_TRACE(mesh.string());
    expect_report_or_one_line(run_brachy({"inspect", mesh.string()}));
    expect_report_or_one_line(
        run_brachy({"inspect", mesh.string(), "--units", "m", "--frame", "LPS", "--json"}));
  }
}

TEST(CheckConfig, NoBadMeshCrashesTheDaemon) {
  BRACHY_REQUIRE_DATA(data);
  const TempFolder folder;
  for (const auto& mesh : files_in(data / "meshes" / "bad")) {
    SCOPED_TRACE(mesh.string());
    const std::string scene = folder.write("s.toml", scene_with_mesh(mesh.string()));
    const Ended ended = run_brachyd({"--check-config", scene});
    if (ended.exit_code == 0)
      EXPECT_EQ(ended.out, scene + ": ok\n");
    else
      EXPECT_TRUE(refused_in_one_line(ended, {mesh.filename().string()}));
  }
}

}  // namespace
}  // namespace brachy
