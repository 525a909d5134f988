// A mesh file, STL, OBJ or PLY by its first byte, read after its prechecks and prepared as a closed surface if it is
// one. assimp itself is Debian's, without the sanitizers: its memory errors show only where it crashes.
#include <array>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
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
