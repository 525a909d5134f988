#include "apps/brachy/files/paraview_writer.h"

#include <fmt/format.h>

#include <cstdint>
#include <stdexcept>

#include "apps/brachy/files/vtp_parts.h"

namespace brachy {
namespace {

/// One value for the whole mesh.
std::string field(const char* type, const char* name, std::size_t offset) {
  return fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfTuples="1" format="appended" offset="{}"/>)",
                     type, name, offset);
}

}  // namespace

ParaviewWriter::ParaviewWriter(std::filesystem::path folder, std::vector<Triangle> triangles,
                               std::vector<float> rest_vertices, std::size_t surface_count)
    : folder_(std::move(folder)),
      triangles_(std::move(triangles)),
      rest_(std::move(rest_vertices)),
      surface_count_(surface_count),
      index_(folder_ / "recording.pvd", std::ios::binary) {
  index_ << kPvdHead << kPvdTail << std::flush;
  if (!index_) throw std::runtime_error((folder_ / "recording.pvd").string() + ": cannot be written");
}

void ParaviewWriter::add(double time_s, const std::vector<float>& deformed_vertices,
                         const std::optional<Certificate>& certificate) {
  const std::string name = fmt::format("mesh_{:06}.vtp", ++steps_);
  write_step(folder_ / name, deformed_vertices, certificate);
  index_.seekp(-static_cast<std::streamoff>(kPvdTail.size()), std::ios::end);
  index_ << fmt::format("    <DataSet timestep=\"{}\" file=\"{}\"/>\n", time_s, name) << kPvdTail
         << std::flush;
  if (!index_)
    throw std::runtime_error((folder_ / "recording.pvd").string() + ": cannot be written; is the disk full?");
}

void ParaviewWriter::write_step(const std::filesystem::path& file,
                                const std::vector<float>& deformed_vertices,
                                const std::optional<Certificate>& certificate) {
  const std::size_t points = rest_.size() / 3, interior = points - surface_count_;
  std::vector<float> displacement(rest_.size());
  for (std::size_t i = 0; i < rest_.size(); ++i) displacement[i] = deformed_vertices[i] - rest_[i];
  std::vector<std::int32_t> vertices(interior);
  for (std::size_t i = 0; i < interior; ++i) vertices[i] = static_cast<std::int32_t>(surface_count_ + i);

  VtpBlocks data;
  const std::size_t x = data.add(deformed_vertices), u = data.add(displacement);
  const std::size_t verts = data.add(vertices), vert_ends = data.add(vtp_offsets(interior, 1));
  const std::size_t polys = data.add(vtp_corners(triangles_)),
                    poly_ends = data.add(vtp_offsets(triangles_.size(), 3));
  const Verdict known = certificate ? certificate->verdict : Verdict::kUnknown;
  const std::size_t verdict = data.add(std::vector{static_cast<std::int32_t>(known)});
  const std::size_t det_bound =
      data.add(std::vector{certificate ? certificate->det_bound : Certificate::kNotKnown});
  std::ofstream out(file, std::ios::binary);
  out << kVtpHead << "<FieldData>" << field("Int32", "verdict", verdict)
      << field("Float64", "det_bound", det_bound) << "</FieldData>\n"
      << fmt::format(
             "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
             "NumberOfPolys=\"{}\">\n",
             points, interior, triangles_.size())
      << "<PointData Vectors=\"displacement\">" << vtp_array("Float32", "displacement", 3, u)
      << "</PointData>\n"
      << "<Points>" << vtp_array("Float32", "Points", 3, x) << "</Points>\n"
      << "<Verts>" << vtp_array("Int32", "connectivity", 1, verts)
      << vtp_array("Int32", "offsets", 1, vert_ends) << "</Verts>\n"
      << "<Polys>" << vtp_array("Int32", "connectivity", 1, polys)
      << vtp_array("Int32", "offsets", 1, poly_ends) << "</Polys>\n</Piece>\n"
      << vtp_tail(data);
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written; is the disk full?");
}

}  // namespace brachy
