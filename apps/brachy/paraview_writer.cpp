#include "apps/brachy/paraview_writer.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <stdexcept>

namespace brachy {
namespace {

static_assert(std::endian::native == std::endian::little, "the .vtp files say LittleEndian");

constexpr const char* kIndexEnd = "  </Collection>\n</VTKFile>\n";

/// The raw blocks behind a .vtp's <AppendedData>: each a byte count and its bytes.
class Appended {
 public:
  template <class T>
  std::size_t add(const std::vector<T>& values) {
    const std::size_t offset = data_.size();
    const std::uint64_t bytes = values.size() * sizeof(T);
    append(&bytes, sizeof bytes);
    append(values.data(), bytes);
    return offset;
  }
  const std::string& data() const { return data_; }

 private:
  void append(const void* bytes, std::size_t count) { data_.append(static_cast<const char*>(bytes), count); }
  std::string data_;
};

std::string array(const char* type, const char* name, int components, std::size_t offset) {
  return fmt::format(
      R"(<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>)", type, name,
      components, offset);
}

/// One value for the whole mesh.
std::string field(const char* type, const char* name, std::size_t offset) {
  return fmt::format(R"(<DataArray type="{}" Name="{}" NumberOfTuples="1" format="appended" offset="{}"/>)",
                     type, name, offset);
}

std::vector<std::int32_t> offsets(std::size_t count, std::int32_t stride) {
  std::vector<std::int32_t> result(count);
  for (std::size_t i = 0; i < count; ++i) result[i] = static_cast<std::int32_t>(i + 1) * stride;
  return result;
}

}  // namespace

ParaviewWriter::ParaviewWriter(std::filesystem::path folder, std::vector<Triangle> triangles,
                               std::vector<float> rest_vertices, std::size_t surface_count)
    : folder_(std::move(folder)),
      triangles_(std::move(triangles)),
      rest_(std::move(rest_vertices)),
      surface_count_(surface_count),
      index_(folder_ / "recording.pvd", std::ios::binary) {
  index_ << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" "
            "byte_order=\"LittleEndian\">\n"
            "  <Collection>\n"
         << kIndexEnd << std::flush;
  if (!index_) throw std::runtime_error((folder_ / "recording.pvd").string() + ": cannot be written");
}

void ParaviewWriter::add(double time_s, const std::vector<float>& deformed_vertices,
                         const std::optional<Certificate>& certificate) {
  const std::string name = fmt::format("mesh_{:06}.vtp", ++steps_);
  write_step(folder_ / name, deformed_vertices, certificate);
  index_.seekp(-static_cast<std::streamoff>(std::string_view(kIndexEnd).size()), std::ios::end);
  index_ << fmt::format("    <DataSet timestep=\"{}\" file=\"{}\"/>\n", time_s, name) << kIndexEnd
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
  std::vector<std::int32_t> corners, vertices(interior);
  for (const Triangle& t : triangles_)
    for (std::uint32_t corner : t) corners.push_back(static_cast<std::int32_t>(corner));
  for (std::size_t i = 0; i < interior; ++i) vertices[i] = static_cast<std::int32_t>(surface_count_ + i);

  Appended data;
  const std::size_t x = data.add(deformed_vertices), u = data.add(displacement);
  const std::size_t verts = data.add(vertices), vert_ends = data.add(offsets(interior, 1));
  const std::size_t polys = data.add(corners), poly_ends = data.add(offsets(triangles_.size(), 3));
  const Verdict known = certificate ? certificate->verdict : Verdict::kUnknown;
  const std::size_t verdict = data.add(std::vector{static_cast<std::int32_t>(known)});
  const std::size_t det_bound =
      data.add(std::vector{certificate ? certificate->det_bound : Certificate::kNotKnown});
  std::ofstream out(file, std::ios::binary);
  out << "<?xml version=\"1.0\"?>\n"
         "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
         "header_type=\"UInt64\">\n<PolyData>\n"
      << "<FieldData>" << field("Int32", "verdict", verdict) << field("Float64", "det_bound", det_bound)
      << "</FieldData>\n"
      << fmt::format(
             "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
             "NumberOfPolys=\"{}\">\n",
             points, interior, triangles_.size())
      << "<PointData Vectors=\"displacement\">" << array("Float32", "displacement", 3, u) << "</PointData>\n"
      << "<Points>" << array("Float32", "Points", 3, x) << "</Points>\n"
      << "<Verts>" << array("Int32", "connectivity", 1, verts) << array("Int32", "offsets", 1, vert_ends)
      << "</Verts>\n"
      << "<Polys>" << array("Int32", "connectivity", 1, polys) << array("Int32", "offsets", 1, poly_ends)
      << "</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_" << data.data()
      << "\n</AppendedData>\n</VTKFile>\n";
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written; is the disk full?");
}

}  // namespace brachy
