// A mesh file, STL, OBJ or PLY as its first byte says, read behind its guards and made a closed surface where it is one.
// assimp itself is Debian's, without the sanitizers: what it does to memory shows only where it crashes.
#include <array>

#include "core/mesh_io/mesh_file.h"
#include "core/surface/surface_check.h"
#include "tests/core/tissue/mesh_fixtures.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::array kNames = {"mesh.stl", "mesh.obj", "mesh.ply"};
  Script script(data, size);
  const char* name = kNames[script.u8() % kNames.size()];
  const test::TempFile file(name, text_of(script.rest()));
  SurfaceMesh mesh;
  const bool is_read = reads(file.path().string() + ": ", [&] { mesh = read_mesh_file(file.path()); });
  if (!is_read) return 0;
  EXPECT_FALSE(mesh.triangles.empty());
  for (const Vec3& vertex : mesh.vertices) EXPECT_TRUE(vertex.allFinite());
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) EXPECT_LT(corner, mesh.vertices.size());
  reads("mesh", [&] { prepare_surface(mesh, {}, "mesh"); });
  return 0;
}

}  // namespace brachy::fuzz
