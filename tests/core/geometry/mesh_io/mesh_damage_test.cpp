#include <gtest/gtest.h>

#include "core/base/utf8.h"
#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

SurfaceMesh tetrahedron() {
  return {{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

struct Sample {
  const char* name;
  std::string bytes;
};

std::vector<Sample> samples() {
  const SurfaceMesh mesh = tetrahedron();
  return {{"a.stl", binary_stl(mesh)},
          {"b.stl", text_stl(mesh)},
          {"c.ply", ply(mesh, "ascii")},
          {"d.ply", ply(mesh, "binary_little_endian")},
          {"e.ply", ply(mesh, "binary_big_endian")},
          {"f.obj", text_obj(mesh)}};
}

/// Reads and prepares it: a one-line UserError or a valid mesh. True where it is closed.
bool reads_closed(const TempFile& file) {
  try {
    const SurfaceMesh mesh = read_mesh_file(file.path());
    for (const Triangle& t : mesh.triangles) {
      for (const std::uint32_t v : t) EXPECT_LT(v, mesh.vertices.size());
    }
    for (const Vec3& v : mesh.vertices) EXPECT_TRUE(v.allFinite());
    return prepare_surface(mesh, {}, "mesh").report.watertight;
  } catch (const UserError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return false;
  }
}

TEST(MeshDamage, NoTruncationPassesForAClosedSurface) {
  for (const Sample& sample : samples()) {
    const TempFile file(sample.name, sample.bytes);
    ASSERT_TRUE(reads_closed(file)) << sample.name;
    // A text file may lose its last line break, which leaves the last index of a PLY or OBJ complete.
    const std::size_t end = sample.bytes.size() - (sample.bytes.back() == '\n' ? 1 : 0);
    const bool has_footer = std::string(sample.name) == "b.stl";
    for (std::size_t size = 0; size < end - (has_footer ? 4 : 0); ++size) {
      file.write(sample.bytes.substr(0, size));
      EXPECT_FALSE(reads_closed(file)) << sample.name << " cut at " << size;
    }
  }
}

TEST(MeshDamage, NoChangedByteCrashes) {
  for (const Sample& sample : samples()) {
    const TempFile file(sample.name, sample.bytes);
    std::size_t survived = 0;
    for (std::size_t i = 0; i < sample.bytes.size(); i += 5) {
      std::string bytes = sample.bytes;
      bytes[i] = static_cast<char>("9\xFF\n-\x7F"[i / 5 % 5]);
      file.write(bytes);
      survived += reads_closed(file);
    }
    EXPECT_GT(survived, 0u) << sample.name;  // the changes are mild enough to reach the parsers
  }
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos);
  return text.replace(text.find(from), from.size(), to);
}

std::string refusal(const std::string& name, const std::string& bytes) {
  const TempFile file(name, bytes);
  return user_error([&] { read_mesh_file(file.path()); });
}

TEST(MeshDamage, DeclaredCountsThatTheFileCannotHoldAreRefused) {
  std::string stl = binary_stl(tetrahedron());
  for (const std::uint32_t count : {0u, 3u, 5u, 0x7FFFFFFFu, 0xFFFFFFFFu}) {
    std::memcpy(stl.data() + 80, &count, 4);
    EXPECT_NE(refusal("a.stl", stl).find("declares " + std::to_string(count)), std::string::npos) << count;
  }
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string good = ply(tetrahedron(), format);
    for (const char* count : {"4294967295", "18446744073709551616", "99999999", "-1", "1e9", "x"}) {
      refusal("a.ply", with(good, "vertex 4", std::string("vertex ") + count));
      EXPECT_NE(refusal("b.ply", with(good, "face 4", std::string("face ") + count)).find("damaged"),
                std::string::npos)
          << format << " " << count;
    }
    EXPECT_NE(refusal("b.ply", with(good, "face 4", "face 5")).find("face 4 of 5"), std::string::npos);
    EXPECT_FALSE(reads_closed(TempFile("b.ply", with(good, "vertex 4", "vertex 5"))));
    refusal("c.ply", with(good, "face 4", "face 0"));
    refusal("d.ply", with(good, "vertex 4", "vertex 0"));
  }
}

TEST(MeshDamage, AFaceOfMoreCornersThanTheFileHoldsIsRefused) {
  const std::string text = ply(tetrahedron(), "ascii");
  for (const char* count : {"4000000000", "-3", "99"}) {
    EXPECT_NE(refusal("a.ply", with(text, "3 1 2 3", std::string(count) + " 1 2 3")).find("face 3 of 4"),
              std::string::npos);
  }
  std::string wide = with(ply(tetrahedron(), "binary_little_endian"), "list uchar", "list uint");
  EXPECT_NE(refusal("b.ply", wide).find("within face"), std::string::npos);
}

TEST(MeshDamage, AnIndexBeyondTheVerticesIsRefused) {
  for (const char* index : {"4", "-1", "4294967295"}) {
    refusal("a.ply", with(ply(tetrahedron(), "ascii"), "3 1 2 3", std::string("3 1 2 ") + index));
  }
  for (const char* index : {"5", "0", "-5", "4294967296"}) {
    refusal("a.obj", with(text_obj(tetrahedron()), "f 2 3 4", std::string("f 2 3 ") + index));
  }
}

// assimp leaked its allocations for such a file.
TEST(MeshDamage, APlyHeadersLineOfNoKnownKindIsRefusedAndNamed) {
  const std::string good = ply(tetrahedron(), "ascii");
  EXPECT_NE(
      refusal("a.ply", with(good, "property float y", "0property float y")).find("line 5 of the PLY header"),
      std::string::npos);
  EXPECT_NE(refusal("b.ply", with(good, "element vertex", "property float x\nelement vertex")).find("line 3"),
            std::string::npos);
  EXPECT_TRUE(reads_closed(
      TempFile("c.ply", with(good, "element vertex", "comment by hand\nobj_info 1\nelement vertex"))));
}

// A fuzz run found it: the element that ends too soon was quoted with the control characters of its name.
TEST(MeshDamage, APlyElementsNameIsQuotedAsOneShortLine) {
  const std::string name = "edge\x01\x7F" + std::string(5000, 'x');
  const std::string message = refusal("a.ply", with(ply(tetrahedron(), "ascii"), "end_header",
                                                    "element " + name + " 2\nproperty int a\nend_header"));
  EXPECT_NE(message.find("within edge  xxx"), std::string::npos) << message;
  EXPECT_LT(message.size(), 400U);
  EXPECT_TRUE(is_printable(message)) << message;
}

TEST(MeshDamage, APointCloudIsRefused) {
  const std::string cloud =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
      "z\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_NE(refusal("a.ply", cloud).find("no faces"), std::string::npos);
  refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\np 1\nl 1 2\n");
}

}  // namespace
}  // namespace brachy
