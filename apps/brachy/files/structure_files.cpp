#include "apps/brachy/files/structure_files.h"

#include "apps/brachy/files/vtp_parts.h"
#include "apps/command_line/output_file.h"
#include "core/base/error.h"

namespace brachy {
namespace {

std::string vtp_of(const SurfaceMesh& mesh) {
  std::vector<float> points;
  for (const Vec3& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) points.push_back(static_cast<float>(v[k]));
  VtpBlocks blocks;
  const std::size_t x = blocks.add(points), polys = blocks.add(vtp_corners(mesh.triangles)),
                    ends = blocks.add(vtp_offsets(mesh.triangles.size(), 3));
  return std::string(kVtpHead) +
         fmt::format(
             "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
             "NumberOfPolys=\"{}\">\n",
             mesh.vertices.size(), mesh.triangles.size()) +
         "<Points>" + vtp_array("Float32", "Points", 3, x) + "</Points>\n<Polys>" +
         vtp_array("Int32", "connectivity", 1, polys) + vtp_array("Int32", "offsets", 1, ends) +
         "</Polys>\n</Piece>\n" + vtp_tail(blocks);
}

}  // namespace

void write_structures(const std::filesystem::path& folder, const std::vector<Structure>& structures,
                      bool force) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw UserError(folder.string() + ": cannot be created: " + error.message());
  std::string index(kPvdHead);
  for (std::size_t s = 0; s < structures.size(); ++s) {
    const std::string& name = structures[s].name;
    write_text(folder / (name + ".vtp"), vtp_of(structures[s].mesh), force);
    index +=
        fmt::format("    <DataSet timestep=\"0\" part=\"{}\" name=\"{}\" file=\"{}.vtp\"/>\n", s, name, name);
  }
  write_text(folder / "structures.pvd", index + std::string(kPvdTail), force);
}

}  // namespace brachy
