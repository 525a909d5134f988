#include "core/geometry/mesh_io/ply_writer.h"

#include <gtest/gtest.h>

#include <sstream>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

TEST(PlyWriter, DoublesComeBackBitForBit) {
  SurfaceMesh mesh = make_box({-1.0 / 3, 1e-17, 2.0 / 7}, {1e17 / 3, 0.1, 123456.789});
  std::vector<double> det(8);
  for (std::size_t i = 0; i < 8; ++i) det[i] = 1.0 / (3.0 + static_cast<double>(i));
  const TempFile file("out.ply");
  write_ply(file.path(), mesh, {"det", det});

  std::istringstream text(file.read());
  std::string line, header;
  while (std::getline(text, line) && line != "end_header") header += line + "\n";
  EXPECT_EQ(
      header,
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\n"
      "property double det\nelement face 12\nproperty list uchar int vertex_indices\n");
  for (std::size_t v = 0; v < 8; ++v) {
    double x, y, z, d;
    ASSERT_TRUE(text >> x >> y >> z >> d);
    EXPECT_EQ(Vec3(x, y, z), mesh.vertices[v]);
    EXPECT_EQ(d, det[v]);
  }
  for (const Triangle& t : mesh.triangles) {
    std::uint32_t n, a, b, c;
    ASSERT_TRUE(text >> n >> a >> b >> c);
    EXPECT_EQ(n, 3u);
    EXPECT_EQ((Triangle{a, b, c}), t);
  }
  EXPECT_FALSE(text >> line);
}

TEST(PlyWriter, WhatItWritesIsRead) {
  const SurfaceMesh mesh = make_box({1, 2, 3}, {4, 5, 6});
  const std::vector<double> det(8, 0.5);
  const TempFile file("out.ply");
  write_ply(file.path(), mesh, {"det", det});
  const SurfaceReport report = prepare_surface(read_mesh_file(file.path()), {}, "box").report;
  EXPECT_TRUE(report.watertight);
  EXPECT_NEAR(report.volume_cc, 0.027, 1e-9);
}

TEST(PlyWriter, AFullDiskOrMissingFolderIsAnError) {
  const SurfaceMesh mesh = make_box({1, 2, 3}, {4, 5, 6});
  const std::string full = user_error([&] { write_ply("/dev/full", mesh); });
  EXPECT_NE(full.find("No space left"), std::string::npos) << full;
  EXPECT_TRUE(std::filesystem::exists("/dev/full"));
  const std::string missing = user_error([&] { write_ply("/nowhere/at/all.ply", mesh); });
  EXPECT_NE(missing.find("/nowhere/at/all.ply"), std::string::npos) << missing;
}

}  // namespace
}  // namespace brachy
