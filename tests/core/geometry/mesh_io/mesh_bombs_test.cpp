// Small files that ask for much work: each loads or is refused in seconds of one core (tests/timed.h).
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <numbers>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/mesh_io/polygon.h"
#include "core/geometry/surface/surface_check.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/timed.h"

namespace brachy {
namespace {

using namespace test;

constexpr double kMostS = 5;

/// "" where the file loads and is checked, else the message.
std::string outcome(const TempFile& file, SurfaceReport* report = nullptr) {
  try {
    const PreparedSurface surface = prepare_surface(read_mesh_file(file.path()), {}, "mesh");
    if (report) *report = surface.report;
    return "";
  } catch (const UserError& error) {
    return error.what();
  }
}

std::string bytes_of(std::uint32_t value) {
  std::string bytes(4, '\0');
  for (int k = 0; k < 4; ++k) bytes[static_cast<std::size_t>(k)] = static_cast<char>(value >> 8 * k);
  return bytes;
}
std::string bytes_of(float value) {
  return bytes_of(std::bit_cast<std::uint32_t>(value));
}

SurfaceMesh nested_boxes(int count) {
  SurfaceMesh boxes;
  boxes.vertices.reserve(8 * static_cast<std::size_t>(count));
  boxes.triangles.reserve(12 * static_cast<std::size_t>(count));
  for (int i = 1; i <= count; ++i) {
    const SurfaceMesh box = make_box(Vec3::Constant(-0.01 * i), Vec3::Constant(0.01 * i));
    const auto base = static_cast<std::uint32_t>(boxes.vertices.size());
    boxes.vertices.insert(boxes.vertices.end(), box.vertices.begin(), box.vertices.end());
    for (const Triangle& t : box.triangles)
      boxes.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  }
  return boxes;
}

TEST(MeshBombs, TwoThousandNestedShellsAreToldApartInSeconds) {
  const MostProcessorTime limit(kMostS);
  const SurfaceReport report = prepare_surface(nested_boxes(2000), {}, "mesh").report;
  EXPECT_EQ(report.components, 2000u);
  EXPECT_EQ(report.cavities, 1000u);
}

TEST(MeshBombs, MoreShellsThanCanBeToldApartInTimeAreRefused) {
  for (const int shells : {8000, 30'000}) {
    const MostProcessorTime limit(kMostS);
    try {
      prepare_surface(nested_boxes(shells), {}, "mesh");
      ADD_FAILURE() << shells << " shells";
    } catch (const UserError& error) {
      EXPECT_NE(std::string(error.what()).find("one closed surface"), std::string::npos) << error.what();
    }
  }
}

/// `polygons` stars of 100 corners, each with a deep notch beside each point.
std::string stars(std::uint32_t polygons) {
  std::string ply =
      "ply\nformat binary_little_endian 1.0\nelement vertex 100\nproperty float x\nproperty float y\n"
      "property float z\nelement face " +
      std::to_string(polygons) + "\nproperty list int int vertex_indices\nend_header\n";
  for (int i = 0; i < 100; ++i) {
    const double angle = 2 * std::numbers::pi * i / 100, r = i % 2 ? 1 : 40;
    ply += bytes_of(static_cast<float>(r * std::cos(angle))) +
           bytes_of(static_cast<float>(r * std::sin(angle))) + bytes_of(0.0f);
  }
  std::string face = bytes_of(100u);
  for (std::uint32_t i = 0; i < 100; ++i) face += bytes_of(i);
  for (std::uint32_t p = 0; p < polygons; ++p) ply += face;
  return ply;
}

TEST(MeshBombs, PolygonsOfAHundredCornersAreCutOrRefusedInSeconds) {
  const TempFile few("few.ply", stars(200)), many("many.ply", stars(150'000));
  {
    const MostProcessorTime limit(kMostS);
    EXPECT_EQ(outcome(few), "");
  }
  const MostProcessorTime limit(kMostS);
  EXPECT_NE(outcome(many).find("too many polygons of many corners"), std::string::npos);
}

TEST(MeshBombs, APolygonTakesStepsThatGrowWithTheSquareOfItsCorners) {
  for (const int corners : {20, 50, 100}) {
    std::vector<Vec3> star;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners, r = i % 2 ? 3 : 10;
      star.emplace_back(r * std::cos(angle), r * std::sin(angle), 0);
    }
    std::size_t work = 0;
    EXPECT_EQ(triangulate_polygon(star, work).size(), static_cast<std::size_t>(corners - 2));
    EXPECT_LT(work, 4u * static_cast<std::size_t>(corners * corners));
  }
}

TEST(MeshBombs, AnObjOfManyMaterialsLoadsAsOneOfNone) {
  std::string plain = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n", bomb = "mtllib x.mtl\n" + plain;
  for (int i = 0; i < 20'000; ++i) {
    const std::string name = "m" + std::to_string(i);
    bomb += "usemtl " + name + "\ng " + name + "\no " + name + "\ns " + std::to_string(i) + "\n";
    for (const char* face : {"f 1 3 2\n", "f 1 2 4\n", "f 1 4 3\n", "f 2 3 4\n"}) bomb += face, plain += face;
  }
  const TempFile with("with.obj", bomb), without("without.obj", plain);
  SurfaceReport report;
  {
    const MostProcessorTime limit(kMostS);
    EXPECT_EQ(outcome(with, &report), "");
  }
  EXPECT_TRUE(report.watertight);
  EXPECT_EQ(read_mesh_file(with.path()).triangles, read_mesh_file(without.path()).triangles);
}

TEST(MeshBombs, AContinuedLineOfAnObjBelongsToItsFirst) {
  const TempFile file("continued.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\\\nf 1 2 3\nf 1 \\\n2 3\n");
  EXPECT_EQ(read_mesh_file(file.path()).triangles.size(), 1u);
}

TEST(MeshBombs, AnStlOfManySolidsAndAPlyOfManyElementsAreRefused) {
  std::string stl, ply = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 200'000; ++i)
    stl += "solid s\nendsolid s\n", ply += "element e" + std::to_string(i) + " 0\n";
  const TempFile solids("many.stl", stl), elements("many.ply", ply + "end_header\n");
  const MostProcessorTime limit(kMostS);
  EXPECT_NE(outcome(solids).find("solids"), std::string::npos);
  EXPECT_NE(outcome(elements).find("header is longer"), std::string::npos);
}

TEST(MeshBombs, VerticesCrowdedIntoOnePlaceAreWeldedInSeconds) {
  SurfaceMesh crowd;
  std::uint64_t random = 1;
  for (int i = 0; i < 400'000; ++i) {
    Vec3 v;
    for (int k = 0; k < 3; ++k) {
      random = random * 6364136223846793005u + 1442695040888963407u;
      v[k] = 4e-3 * static_cast<double>(random >> 40) / 0x1p24;  // 40 tolerances wide
    }
    crowd.vertices.push_back(v);
  }
  for (std::uint32_t i = 0; i + 2 < 400'000; i += 3) crowd.triangles.push_back({i, i + 1, i + 2});
  const MostProcessorTime limit(kMostS);
  prepare_surface(crowd, {}, "mesh");
}

}  // namespace
}  // namespace brachy
