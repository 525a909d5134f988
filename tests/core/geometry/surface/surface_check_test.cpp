#include "core/geometry/surface/surface_check.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>

#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

/// Each triangle with its own corners, as in an STL.
SurfaceMesh soup(const SurfaceMesh& mesh) {
  SurfaceMesh apart;
  for (const Triangle& t : mesh.triangles) {
    const auto base = static_cast<std::uint32_t>(apart.vertices.size());
    for (const std::uint32_t v : t) apart.vertices.push_back(mesh.vertices[v]);
    apart.triangles.push_back({base, base + 1, base + 2});
  }
  return apart;
}

PreparedSurface prepare(const SurfaceMesh& mesh, const SurfaceOptions& options = {}) {
  return prepare_surface(mesh, options, "mesh.stl");
}

TEST(SurfaceCheck, WeldsASoupIntoAClosedBox) {
  const SurfaceReport report = prepare(soup(make_box({0, 0, 0}, {10, 20, 30}))).report;
  EXPECT_EQ(report.vertices, 8u);
  EXPECT_EQ(report.triangles, 12u);
  EXPECT_EQ(report.welded_vertices, 28u);
  EXPECT_EQ(report.components, 1u);
  EXPECT_EQ(report.bad_edges, 0u);
  EXPECT_TRUE(report.watertight);
  EXPECT_NEAR(report.volume_cc, 6, 1e-12);
  EXPECT_EQ(report.min_mm, Vec3(0, 0, 0));
  EXPECT_EQ(report.max_mm, Vec3(10, 20, 30));
  EXPECT_NO_THROW(require_closed(report, "mesh.stl"));
}

TEST(SurfaceCheck, WeldsWithinTheToleranceAndNotBeyond) {
  for (const double tolerance : {1e-6, 1e-4, 0.01}) {
    SurfaceMesh mesh = soup(make_box({0, 0, 0}, {10, 20, 30}));
    std::mt19937 random(7);
    std::uniform_real_distribution<double> jitter(-0.28 * tolerance,
                                                  0.28 * tolerance);  // ≤ 0.97 tolerances apart
    for (Vec3& v : mesh.vertices) v += Vec3(jitter(random), jitter(random), jitter(random));
    EXPECT_EQ(prepare(mesh, {.weld_tolerance_mm = tolerance}).report.vertices, 8u) << tolerance;
    EXPECT_GT(prepare(mesh, {.weld_tolerance_mm = tolerance / 100}).report.vertices, 8u) << tolerance;
    EXPECT_EQ(prepare(mesh, {.weld_tolerance_mm = 0}).report.vertices, 36u) << tolerance;
  }
  EXPECT_EQ(prepare(soup(make_box({-0.0, 0, 0}, {1, 1, 1})), {.weld_tolerance_mm = 0}).report.vertices, 8u);
}

TEST(SurfaceCheck, ResultDoesNotDependOnTheInputsOrder) {
  const SurfaceMesh expected = prepare(prostate_phantom()).mesh;
  SurfaceMesh mesh = soup(prostate_phantom());
  std::mt19937 random(3);
  for (std::size_t i = mesh.triangles.size(); i > 1; --i) {
    std::swap(mesh.triangles[i - 1], mesh.triangles[random() % i]);
    std::rotate(mesh.triangles[i - 1].begin(), mesh.triangles[i - 1].begin() + random() % 3,
                mesh.triangles[i - 1].end());
  }
  const SurfaceMesh shuffled = prepare(soup(mesh)).mesh;
  EXPECT_EQ(shuffled.vertices, expected.vertices);
  EXPECT_EQ(shuffled.triangles, expected.triangles);
}

TEST(SurfaceCheck, DropsDegenerateAndRepeatedTrianglesAndStrayVertices) {
  SurfaceMesh mesh = make_box({0, 0, 0}, {10, 10, 10});
  mesh.vertices.emplace_back(99, 99, 99);
  mesh.triangles.push_back({0, 1, 1});
  mesh.triangles.push_back({3, 0, 2});  // again, from another corner
  mesh.triangles.push_back({0, 3, 2});  // again, the other way round
  const SurfaceReport report = prepare(mesh).report;
  EXPECT_EQ(report.degenerate_triangles, 1u);
  EXPECT_EQ(report.duplicate_triangles, 2u);
  EXPECT_EQ(report.vertices, 8u);
  EXPECT_TRUE(report.watertight);
  EXPECT_EQ(report.max_mm, Vec3(10, 10, 10));
}

TEST(SurfaceCheck, TurnsEverythingOutward) {
  SurfaceMesh inside_out = make_box({0, 0, 0}, {10, 10, 10});
  turn_inside_out(inside_out);
  const PreparedSurface turned = prepare(inside_out);
  EXPECT_EQ(turned.report.flipped_triangles, 12u);
  EXPECT_NEAR(signed_volume(turned.mesh), 1000, 1e-9);

  SurfaceMesh mixed = prostate_phantom();
  std::size_t flipped = 0;
  for (std::size_t t = 0; t < mixed.triangles.size(); t += 3, ++flipped)
    std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
  const PreparedSurface repaired = prepare(mixed);
  EXPECT_EQ(repaired.report.flipped_triangles, flipped);
  EXPECT_EQ(repaired.mesh.triangles, prepare(prostate_phantom()).mesh.triangles);
}

TEST(SurfaceCheck, EachComponentIsTurnedOnItsOwn) {
  SurfaceMesh left = make_box({0, 0, 0}, {10, 10, 10});
  turn_inside_out(left);
  const SurfaceReport report = prepare(joined(left, make_box({20, 0, 0}, {30, 10, 10}))).report;
  EXPECT_EQ(report.components, 2u);
  EXPECT_EQ(report.flipped_triangles, 12u);
  EXPECT_NEAR(report.volume_cc, 2, 1e-12);
}

TEST(SurfaceCheck, DropsIslandsBelowTheShareOnly) {
  const SurfaceMesh body = make_box({0, 0, 0}, {10, 10, 10}),
                    island = make_box({20, 0, 0}, {22, 2, 2});  // 0.8 %
  const SurfaceMesh both = joined(body, island);
  const SurfaceReport dropped = prepare(both, {.min_island_share = 0.01}).report;
  EXPECT_EQ(dropped.components, 1u);
  EXPECT_EQ(dropped.dropped_islands, 1u);
  EXPECT_NEAR(dropped.dropped_island_volume_cc, 0.008, 1e-12);
  EXPECT_EQ(dropped.vertices, 8u);
  EXPECT_NEAR(dropped.volume_cc, 1, 1e-12);
  const SurfaceReport kept = prepare(both, {.min_island_share = 0.005}).report;
  EXPECT_EQ(kept.components, 2u);
  EXPECT_EQ(kept.dropped_islands, 0u);
  EXPECT_NEAR(kept.volume_cc, 1.008, 1e-12);
}

TEST(SurfaceCheck, AStrayOpenTriangleBesideABodyIsAnIsland) {
  SurfaceMesh mesh = make_box({0, 0, 0}, {10, 10, 10});
  mesh = joined(mesh, {{Vec3(30, 0, 0), Vec3(31, 0, 0), Vec3(30, 1, 0)}, {{0, 1, 2}}});
  const SurfaceReport report = prepare(mesh).report;
  EXPECT_EQ(report.dropped_islands, 1u);
  EXPECT_TRUE(report.watertight);
}

TEST(SurfaceCheck, AnOpenBodyIsNotTakenForAnIslandOfItsDebris) {
  SurfaceMesh mesh = make_box({0, 0, 0}, {10, 10, 10});
  mesh.triangles.resize(2);  // one flat face: no volume
  const SurfaceReport report = prepare(joined(mesh, make_box({20, 0, 0}, {20.1, 0.1, 0.1}))).report;
  EXPECT_EQ(report.dropped_islands, 1u);
  EXPECT_EQ(report.triangles, 2u);
  EXPECT_EQ(report.open_edges, 4u);
}

TEST(SurfaceCheck, ManyEqualPiecesAreNoIslands) {
  SurfaceMesh mesh;
  for (int i = 0; i < 200; ++i) {
    const double x = 3.0 * i;
    mesh = joined(mesh, {{Vec3(x, 0, 0), Vec3(x + 1, 0, 0), Vec3(x, 1, 0)}, {{0, 1, 2}}});
  }
  const SurfaceReport report = prepare(mesh).report;
  EXPECT_EQ(report.dropped_islands, 0u);
  EXPECT_EQ(report.components, 200u);
  EXPECT_EQ(report.open_edges, 600u);
}

TEST(SurfaceCheck, AClosedSurfaceInsideAnotherIsACavity) {
  const SurfaceMesh shell = joined(make_box({0, 0, 0}, {10, 10, 10}), make_box({2, 2, 2}, {8, 8, 8}));
  const PreparedSurface hollow = prepare(shell);
  EXPECT_EQ(hollow.report.cavities, 1u);
  EXPECT_NEAR(hollow.report.volume_cc, 1 - 0.216, 1e-12);
  EXPECT_NEAR(signed_volume(hollow.mesh), 784, 1e-9);
  const PreparedSurface core =
      prepare(joined(shell, make_box({4, 4, 4}, {6, 6, 6})), {.min_island_share = 0});
  EXPECT_EQ(core.report.cavities, 1u);
  EXPECT_NEAR(core.report.volume_cc, 1 - 0.216 + 0.008, 1e-12);
}

TEST(SurfaceCheck, AHoleIsCountedAndRefusedWithTheFix) {
  SurfaceMesh mesh = make_box({0, 0, 0}, {10, 10, 10});
  mesh.triangles.pop_back();
  const SurfaceReport report = prepare(mesh).report;  // inspection does not refuse
  EXPECT_EQ(report.open_edges, 3u);
  EXPECT_EQ(report.bad_edges, 3u);
  EXPECT_FALSE(report.watertight);
  const std::string message = user_error([&] { require_closed(report, "gland.stl"); });
  EXPECT_EQ(message.find("gland.stl: "), 0u);
  EXPECT_NE(message.find("3 bad edges (3 open"), std::string::npos) << message;
  EXPECT_NE(message.find("Close Holes"), std::string::npos) << message;
}

TEST(SurfaceCheck, ATriangleTooManyIsNonManifold) {
  SurfaceMesh mesh = make_box({0, 0, 0}, {10, 10, 10});
  mesh.vertices.emplace_back(20, 20, 20);
  mesh.triangles.push_back({0, 1, 8});
  const SurfaceReport report = prepare(mesh).report;
  EXPECT_EQ(report.nonmanifold_edges, 1u);
  EXPECT_EQ(report.open_edges, 2u);
  EXPECT_EQ(report.bad_edges, 3u);
  EXPECT_EQ(report.components, 1u);
  user_error([&] { require_closed(report, "gland.stl"); });
}

TEST(SurfaceCheck, AMoebiusStripIsTwisted) {
  SurfaceMesh strip;
  constexpr std::uint32_t kSteps = 12;
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    const double a = 2 * M_PI * i / kSteps;
    for (const double s : {-1.0, 1.0}) {
      const double r = 10 + s * std::cos(a / 2);
      strip.vertices.emplace_back(r * std::cos(a), r * std::sin(a), s * std::sin(a / 2));
    }
    const std::uint32_t p = 2 * i, q = p + 1;
    const std::uint32_t next_p = i + 1 < kSteps ? p + 2 : 1, next_q = i + 1 < kSteps ? q + 2 : 0;
    strip.triangles.push_back({p, q, next_p});
    strip.triangles.push_back({q, next_q, next_p});
  }
  const SurfaceReport report = prepare(strip).report;
  EXPECT_EQ(report.open_edges, 2 * kSteps);
  EXPECT_EQ(report.nonmanifold_edges, 0u);
  EXPECT_EQ(report.twisted_edges, 1u);
  user_error([&] { require_closed(report, "strip.stl"); });
}

TEST(SurfaceCheck, AFlatOrVanishedSurfaceIsRefused) {
  const SurfaceReport none = prepare(make_box({0, 0, 0}, {1e-5, 1e-5, 1e-5})).report;
  EXPECT_EQ(none.triangles, 0u);
  EXPECT_FALSE(none.watertight);
  EXPECT_NE(user_error([&] { require_closed(none, "m"); }).find("units"), std::string::npos);
  EXPECT_EQ(prepare({}).report.vertices, 0u);
}

TEST(SurfaceCheck, RefusesWhatItCannotMeasure) {
  SurfaceMesh mesh = make_box({0, 0, 0}, {1, 1, 1});
  mesh.vertices[2].z() = std::nan("");
  user_error([&] { prepare(mesh); });
  mesh = make_box({0, 0, 0}, {1, 1, 1});
  mesh.triangles[3][1] = 8;
  user_error([&] { prepare(mesh); });
  mesh = make_box({0, 0, 0}, {1, 1, 1});
  for (const double bad : {-1e-9, std::nan(""), double(INFINITY)}) {
    user_error([&] { prepare(mesh, {.weld_tolerance_mm = bad}); });
    user_error([&] { prepare(mesh, {.min_island_share = bad}); });
  }
}

TEST(SurfaceCheck, AbsurdCoordinatesEndInGoodTime) {
  SurfaceMesh mesh = prostate_phantom(20'000);
  mesh.vertices.emplace_back(1e37, -1e37, 1e300);
  mesh.vertices.emplace_back(-1e37, 1e37, 1e-300);
  mesh.triangles.push_back({0, 20'000, 20'001});
  EXPECT_EQ(prepare(mesh, {.min_island_share = 0}).report.vertices, 20'002u);
}

}  // namespace
}  // namespace brachy
