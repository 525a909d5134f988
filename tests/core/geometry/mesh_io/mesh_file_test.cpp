#include "core/geometry/mesh_io/mesh_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/inotify.h>
#include <sys/stat.h>

#include "core/geometry/surface/surface_check.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

const SurfaceMesh kBox = make_box({1, 2, 3}, {5, 8, 11});  // 4 × 6 × 8 mm

SurfaceReport read_report(const TempFile& file, const MeshFileOptions& options = {}) {
  return prepare_surface(read_mesh_file(file.path(), options), {}, file.path().string()).report;
}

std::string read_error(const std::string& name, const std::string& bytes) {
  const TempFile file(name, bytes);
  const std::string message = user_error([&] { read_mesh_file(file.path()); });
  EXPECT_EQ(message.find(file.path().string()), 0u) << message;
  return message;
}

TEST(MeshFile, ReadsEveryFormatAndEncodingAlike) {
  const std::pair<const char*, std::string> files[] = {{"a.stl", binary_stl(kBox)},
                                                       {"b.stl", text_stl(kBox)},
                                                       {"c.STL", binary_stl(kBox)},
                                                       {"d.Obj", text_obj(kBox)},
                                                       {"e.ply", ply(kBox, "ascii")},
                                                       {"f.PLY", ply(kBox, "binary_little_endian")},
                                                       {"g.ply", ply(kBox, "binary_big_endian")}};
  const SurfaceMesh expected = prepare_surface(kBox, {}, "box").mesh;
  for (const auto& [name, bytes] : files) {
    const TempFile file(name, bytes);
    const PreparedSurface read = prepare_surface(read_mesh_file(file.path()), {}, name);
    EXPECT_EQ(read.mesh.vertices, expected.vertices) << name;
    EXPECT_EQ(read.mesh.triangles, expected.triangles) << name;
    EXPECT_EQ(read.report.flipped_triangles, 0u) << name;
  }
}

TEST(MeshFile, MetresBecomeMillimetresAndLpsBecomesRas) {
  const TempFile file("box.stl", binary_stl(kBox));
  MeshFileOptions options;
  options.units = MeshUnits::kM;
  options.frame = MeshFrame::kLps;
  const SurfaceReport report = read_report(file, options);
  EXPECT_TRUE(report.min_mm.isApprox(Vec3(-5000, -8000, 3000), 1e-12)) << report.min_mm.transpose();
  EXPECT_TRUE(report.max_mm.isApprox(Vec3(-1000, -2000, 11000), 1e-12)) << report.max_mm.transpose();
  EXPECT_EQ(report.flipped_triangles, 0u);  // half a turn, no mirror
}

TEST(MeshFile, CutsPolygonsAndDropsPointsAndLines) {
  // An L-shaped prism: two concave hexagons and six quads; also a line and a point.
  std::string text;
  const double outline[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
  for (int z = 0; z < 2; ++z) {
    for (const auto& p : outline)
      text += "v " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(z) + "\n";
  }
  text += "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\nl 1 2\np 3\n";
  for (int i = 0; i < 6; ++i) {
    const int next = (i + 1) % 6;
    text += "f " + std::to_string(i + 1) + " " + std::to_string(next + 1) + " " + std::to_string(next + 7) +
            " " + std::to_string(i + 7) + "\n";
  }
  const SurfaceReport report = read_report(TempFile("prism.obj", text));
  EXPECT_EQ(report.triangles, 20u);
  EXPECT_TRUE(report.watertight);
  EXPECT_NEAR(report.volume_cc, 3e-3, 1e-12);  // a fan would cut across the notch
  EXPECT_EQ(report.flipped_triangles, 0u);
}

TEST(MeshFile, RefusesOtherFormatsWhateverTheyHold) {
  for (const char* name : {"box.dae", "box.off", "box.blend", "box.stl.gz", "box"}) {
    EXPECT_NE(read_error(name, binary_stl(kBox)).find(".stl, .obj or .ply"), std::string::npos) << name;
  }
}

TEST(MeshFile, RefusesOneFormatUnderAnothersName) {
  read_error("box.stl", ply(kBox, "ascii"));
  read_error("box.stl", text_obj(kBox));
  read_error("box.ply", text_stl(kBox));
  read_error("box.obj", binary_stl(kBox));
  read_error("box.obj", text_stl(kBox));
  read_error("box.stl", "Dear reader, this is a letter and no mesh at all.\n");
  read_error("box.ply", "plywood\n");
}

TEST(MeshFile, RefusesWhatIsNotAFile) {
  const std::string missing = user_error([] { read_mesh_file("/nowhere/at/all.stl"); });
  EXPECT_NE(missing.find("no such file"), std::string::npos) << missing;
  const TempFile folder("folder.stl");
  std::filesystem::create_directory(folder.path());
  EXPECT_NE(user_error([&] { read_mesh_file(folder.path()); }).find("directory"), std::string::npos);
  const TempFile pipe("pipe.stl");
  ASSERT_EQ(::mkfifo(pipe.path().c_str(), 0600), 0);
  EXPECT_NE(user_error([&] { read_mesh_file(pipe.path()); }).find("regular file"), std::string::npos);
}

TEST(MeshFile, RefusesEmptyAndOversizedFiles) {
  for (const char* name : {"a.stl", "a.obj", "a.ply"}) {
    EXPECT_NE(read_error(name, "").find("is empty"), std::string::npos);
  }
  const TempFile file("box.stl", binary_stl(kBox));
  MeshFileOptions options;
  options.max_bytes = 683;  // the file has 684
  EXPECT_NE(user_error([&] { read_mesh_file(file.path(), options); }).find("limit of 683"),
            std::string::npos);
  options.max_bytes = 684;
  EXPECT_EQ(read_mesh_file(file.path(), options).triangles.size(), 12u);
}

TEST(MeshFile, CountsCoordinatesThatAreNotFinite) {
  SurfaceMesh mesh = kBox;
  mesh.vertices[3].y() = std::nan("");
  mesh.vertices[6].x() = INFINITY;
  EXPECT_NE(read_error("box.ply", ply(mesh, "binary_little_endian")).find(": 2 vertices"), std::string::npos);
  EXPECT_NE(read_error("box.ply", ply(mesh, "ascii")).find(": 2 vertices"), std::string::npos);
  read_error("box.stl", binary_stl(mesh));
  read_error("box.stl", text_stl(mesh));
  read_error("box.obj", text_obj(mesh));
}

TEST(MeshFile, NeverOpensTheMaterialFileAnObjNames) {
  const TempFile material("secret.mtl", "newmtl m\nKd 1 1 1\n");
  const TempFile file("box.obj",
                      "mtllib " + material.path().filename().string() + "\nusemtl m\n" + text_obj(kBox));
  const int watch = ::inotify_init1(IN_NONBLOCK);
  ASSERT_GE(watch, 0);
  ASSERT_GE(::inotify_add_watch(watch, material.path().c_str(), IN_OPEN), 0);
  EXPECT_EQ(read_mesh_file(file.path()).triangles.size(), 12u);
  char event[4096];
  EXPECT_LT(::read(watch, event, sizeof event), 0) << "the .mtl was opened";
  ::close(::open(material.path().c_str(), O_RDONLY));  // the watch detects an opening
  EXPECT_GT(::read(watch, event, sizeof event), 0);
  ::close(watch);
}

TEST(MeshFile, PrintsNothing) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  read_mesh_file(TempFile("a.obj", "mtllib none.mtl\nnonsense\n" + text_obj(kBox)).path());
  read_error("b.stl", text_stl(kBox).substr(0, 300) + "\nendsolid\n");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(MeshFile, ALineBreakInTheNameStaysOutOfTheMessage) {
  const TempFile file("two\nlines.stl", "");
  EXPECT_NE(user_error([&] { read_mesh_file(file.path()); }).find("two lines.stl"), std::string::npos);
}

TEST(MeshFile, FillingBytesMarksAndCapitalsOfAnStlChangeNothing) {
  const std::string binary = binary_stl(kBox), text = text_stl(kBox);
  std::string named = binary, capitals = text;
  named.replace(0, 5, "solid");
  for (char& c : capitals) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  const std::pair<const char*, std::string> files[] = {{"a.stl", named},
                                                       {"b.STL", named + std::string(7, '\0')},
                                                       {"c.stl", binary + "\r\n"},
                                                       {"d.stl", binary + std::string(428, '\0')},
                                                       {"e.stl", binary + "made by a scanner"},
                                                       {"f.stl", capitals},
                                                       {"g.stl", "\xEF\xBB\xBF" + text},
                                                       {"h.stl", text + std::string(100, '\0')},
                                                       {"i.stl", text + "\x1a"},
                                                       {"j.stl", "\n\n" + text},
                                                       {"k.obj", "\xEF\xBB\xBF" + text_obj(kBox)},
                                                       {"l.ply", "\xEF\xBB\xBF" + ply(kBox, "ascii")}};
  for (const auto& [name, bytes] : files) {
    const SurfaceReport report = read_report(TempFile(name, bytes));
    EXPECT_TRUE(report.watertight) << name;
    EXPECT_NEAR(report.volume_cc, 0.192, 1e-6) << name;
    EXPECT_LT((report.min_mm - Vec3(1, 2, 3)).norm(), 1e-5) << name;
  }
  // More triangles than declared are no filling.
  EXPECT_NE(read_error("m.stl", binary + binary.substr(84, 100)).find("binary STL declares 12 triangles"),
            std::string::npos);
}

TEST(MeshFile, AFileThatStatesItsFrameIsInThat) {
  std::string stl = binary_stl(kBox), text = text_stl(kBox), points = ply(kBox, "ascii");
  stl.replace(0, 31, "3D Slicer output. SPACE=LPS    ");
  text.insert(text.find('\n'), " 3D Slicer output. SPACE=LPS");
  points.insert(points.find("element"), "comment 3D Slicer output. SPACE=LPS\n");
  const std::pair<const char*, std::string> files[] = {
      {"a.stl", stl}, {"b.stl", text}, {"c.ply", points}, {"d.obj", "# SPACE=LPS\n" + text_obj(kBox)}};
  for (const auto& [name, bytes] : files)
    for (const MeshFrame frame : {MeshFrame::kRas, MeshFrame::kLps}) {
      const SurfaceReport report = read_report(TempFile(name, bytes), {.frame = frame});
      EXPECT_LT((report.min_mm - Vec3(-5, -8, 3)).norm(), 1e-5) << name;
    }
}

// assimp takes a line's end at the start of the data for the header's.
TEST(MeshFile, ABinaryPlyMayBeginWithAnyByte) {
  const SurfaceMesh box = make_box({-10, -20, -30}, {10, 20, 30});
  for (int first = 0; first < 256; ++first) {
    for (const bool has_doubles : {false, true}) {
      std::string data;
      const auto append = [&](const auto& value) {
        data.append(reinterpret_cast<const char*>(&value), sizeof value);
      };
      for (const Vec3& v : box.vertices)
        for (int k = 0; k < 3; ++k) has_doubles ? append(v[k]) : append(static_cast<float>(v[k]));
      data[0] = static_cast<char>(first);  // the last bits of the first coordinate
      for (const Triangle& t : box.triangles) {
        append(std::uint8_t{3});
        for (const std::uint32_t corner : t) append(corner);
      }
      const std::string type = has_doubles ? "double" : "float";
      const TempFile file("first.ply",
                          "ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty " + type +
                              " x\nproperty " + type + " y\nproperty " + type +
                              " z\nelement face 12\nproperty list uchar uint vertex_indices\nend_header\n" +
                              data);
      const SurfaceMesh read = read_mesh_file(file.path());
      ASSERT_EQ(read.triangles, box.triangles) << first;
      ASSERT_EQ(read.vertices.size(), box.vertices.size()) << first;
      for (std::size_t v = 0; v < 8; ++v)
        EXPECT_LT((read.vertices[v] - box.vertices[v]).norm(), 3e-4) << first;
    }
  }
}

}  // namespace
}  // namespace brachy
