#include "core/geometry/mesh_io/mesh_file.h"

#include <assimp/BaseImporter.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/scene.h>
#include <algorithm>
#include <assimp/Importer.hpp>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/one_line.h"
#include "core/geometry/mesh_io/mesh_precheck.h"
#include "core/geometry/mesh_io/polygon.h"

namespace brachy {
namespace {

/// The only file system the parser sees: one name, in memory. assimp's own memory reader still opens what an .obj
/// names in mtllib.
class OneFileSystem : public Assimp::IOSystem {
 public:
  OneFileSystem(const char* name, const std::string& bytes) : name_(name), bytes_(bytes) {}
  bool Exists(const char* file) const override { return name_ == file; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* file, const char*) override {
    if (!Exists(file)) return nullptr;
    return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(bytes_.data()), bytes_.size());
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  std::string name_;
  const std::string& bytes_;
};

enum class MeshFormat { kStl, kObj, kPly };

constexpr std::size_t kMaxPolygonWork = 100'000'000;  // steps of triangulate_polygon: a second or two

/// assimp's messages quote the file's content, which is untrusted.
std::string quoted(std::string text) {
  text.resize(std::min(text.size(), std::size_t{160}));
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c > 0x7E; }, ' ');
  return text;
}

MeshFormat format_of(const std::filesystem::path& path, const std::string& name) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".stl") return MeshFormat::kStl;
  if (extension == ".obj") return MeshFormat::kObj;
  if (extension == ".ply") return MeshFormat::kPly;
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw UserError(name + ": no such file; check the path");
  if (const std::string other = other_kind(path, FileKind::kMesh); !other.empty()) throw UserError(other);
  throw UserError(name + ": unsupported mesh format; convert it to .stl, .obj or .ply");
}

std::string read_bytes(const std::filesystem::path& path, const std::string& name, std::uintmax_t max_bytes) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  refuse_denied_folder(path);
  if (!std::filesystem::exists(status)) throw UserError(name + ": no such file; check the path");
  if (std::filesystem::is_directory(status))
    throw UserError(name + ": is a directory; name a mesh file in it");
  // A pipe or device could block or never end.
  if (!std::filesystem::is_regular_file(status))
    throw UserError(name + ": is not a regular file; copy it to one");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw UserError(name + ": cannot be read: " + error.message());
  if (size == 0) throw UserError(name + ": is empty; export the mesh again");
  if (size > max_bytes) {
    throw UserError(name + ": has " + std::to_string(size) + " bytes, more than the limit of " +
                    std::to_string(max_bytes) + "; reduce the mesh (decimate it) or raise the limit");
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) throw UserError(name + ": cannot be opened: " + std::strerror(errno));
  std::string bytes(static_cast<std::size_t>(size), '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(file.gcount()) != size) {
    throw UserError(name + ": cannot be read to its end; check the disk, or that nothing is writing it");
  }
  return bytes;
}

/// The frame that the header of an STL, or the first comments of the others, state.
std::optional<MeshFrame> stated_frame(std::string_view bytes, MeshFormat format) {
  constexpr std::size_t kStlHeader = 80, kComments = 4096;
  std::string_view head = bytes.substr(0, format == MeshFormat::kStl ? kStlHeader : kComments);
  if (format == MeshFormat::kPly) head = head.substr(0, head.find("end_header"));
  if (head.find("SPACE=LPS") != std::string_view::npos) return MeshFrame::kLps;
  if (head.find("SPACE=RAS") != std::string_view::npos) return MeshFrame::kRas;
  return std::nullopt;
}

/// Leaves only the importer of `extension`, so that no content can reach another of assimp's forty parsers.
void keep_only(Assimp::Importer& importer, const char* extension) {
  for (std::size_t i = importer.GetImporterCount(); i-- > 0;) {
    Assimp::BaseImporter* candidate = importer.GetImporter(i);
    if (candidate == importer.GetImporter(extension)) continue;
    importer.UnregisterLoader(candidate);
    delete candidate;  // unregistering transferred ownership
  }
}

/// assimp's parsers check neither indices nor numbers.
void check_scene(const aiScene& scene, const std::string& name) {
  std::size_t not_finite = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      not_finite += !(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      for (unsigned k = 0; k < face.mNumIndices; ++k) {
        if (face.mIndices[k] < mesh.mNumVertices) continue;
        throw UserError(name + ": face " + std::to_string(f) + " refers to vertex " +
                        std::to_string(face.mIndices[k]) + " of " + std::to_string(mesh.mNumVertices) +
                        "; the file is damaged, export it again");
      }
    }
  }
  if (not_finite > 0) {
    throw UserError(
        name + ": " + std::to_string(not_finite) +
        " vertices have a coordinate that is not a finite number; repair or export the mesh again");
  }
}

SurfaceMesh to_surface(const aiScene& scene, const MeshFileOptions& options, const std::string& name) {
  std::size_t work = 0;
  const double scale = options.units == MeshUnits::kM ? 1000.0 : 1.0;
  const double xy = options.frame == MeshFrame::kLps ? -scale : scale;  // LPS to RAS: half a turn about z
  SurfaceMesh surface;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    const auto base = static_cast<std::uint32_t>(surface.vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      surface.vertices.emplace_back(xy * p.x, xy * p.y, scale * p.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      std::vector<Vec3> corners;  // points and lines make no triangles
      for (unsigned k = 0; k < face.mNumIndices; ++k)
        corners.push_back(surface.vertices[base + face.mIndices[k]]);
      if (work > kMaxPolygonWork)
        throw UserError(name + ": too many polygons of many corners; export the mesh again as triangles");
      for (const auto& t : triangulate_polygon(corners, work)) {
        surface.triangles.push_back(
            {base + face.mIndices[t[0]], base + face.mIndices[t[1]], base + face.mIndices[t[2]]});
      }
    }
  }
  return surface;
}

SurfaceMesh parse(const std::string& bytes, MeshFormat format, const MeshFileOptions& options,
                  const std::string& name) {
  const char* extension = format == MeshFormat::kStl ? "stl" : format == MeshFormat::kObj ? "obj" : "ply";
  const std::string file = std::string("mesh.") + extension;
  Assimp::Importer importer;
  keep_only(importer, extension);
  importer.SetIOHandler(new OneFileSystem(file.c_str(), bytes));  // takes ownership
  // No post-processing: Debian's build asserts, and its triangulation aborts on odd faces.
  const aiScene* scene = importer.ReadFile(file, 0);
  if (!scene) {
    throw UserError(name + ": cannot be read as ." + extension + " (" + quoted(importer.GetErrorString()) +
                    "); export the mesh again");
  }
  check_scene(*scene, name);
  return to_surface(*scene, options, name);
}

}  // namespace

SurfaceMesh read_mesh_file(const std::filesystem::path& path, const MeshFileOptions& options) {
  const std::string name = one_line(path.string());
  const MeshFormat format = format_of(path, name);
  try {
    std::string bytes = read_bytes(path, name, options.max_bytes);
    if (bytes.starts_with("\xEF\xBB\xBF")) bytes.erase(0, 3);
    MeshFileOptions stated = options;
    stated.frame = stated_frame(bytes, format).value_or(options.frame);
    if (format == MeshFormat::kStl) {
      make_stl_plain(bytes);
      check_stl_bytes(bytes, name);
    }
    if (format == MeshFormat::kObj) {
      check_obj_bytes(bytes, name);
      keep_surface_lines(bytes);
    }
    if (format == MeshFormat::kPly) {
      check_ply_bytes(bytes, name);
      keep_first_byte(bytes);
    }
    SurfaceMesh surface = parse(bytes, format, stated, name);
    if (surface.triangles.empty()) throw UserError(name + ": has no triangles; export a surface mesh");
    return surface;
  } catch (const UserError&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw UserError(name + ": needs more memory than is available; reduce the mesh (decimate it)");
  } catch (const std::exception& error) {  // assimp's own
    throw UserError(name + ": cannot be read (" + quoted(error.what()) + "); export the mesh again");
  }
}

}  // namespace brachy
