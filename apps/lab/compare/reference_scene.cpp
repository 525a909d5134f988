#include "apps/lab/compare/reference_scene.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPoints = 14560;  // the paper's

void read_vectors(const fs::path& file, std::vector<Vec3>& positions, std::vector<Vec3>& displacements) {
  const NumberTable table = load_number_csv(file, "x,y,z,dx,dy,dz");
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto row = table.row(i);
    positions.emplace_back(row[0], row[1], row[2]);
    displacements.emplace_back(row[3], row[4], row[5]);
  }
}

std::string group_of(const ElasticBody& body, const fs::path& folder) {
  if (fs::exists(folder / "linearity.csv")) return "neo_hookean";
  if (std::ranges::find(body.held, false) != body.held.end()) return "free_face";
  const auto other = [&](const auto& region) { return region->shear_modulus != body.shear_modulus; };
  return std::ranges::any_of(body.regions, other) ? "stiff" : "homogeneous";
}

}  // namespace

void fill_gland(const ElasticBody& body, std::vector<Vec3>& points) {
  // M. Roberts' R3 sequence, as core/geometry/tissue/interior_points.h has it for meshes.
  const double g = 1.2207440846057596;
  const Vec3 step(1 / g, 1 / (g * g), 1 / (g * g * g));
  Vec3 unit = Vec3::Constant(0.5);
  while (points.size() < kPoints) {
    unit += step;
    unit = unit.unaryExpr([](double v) { return v - std::floor(v); });
    const Vec3 X = body.box_centre + body.box_size.cwiseProduct(unit - Vec3::Constant(0.5));
    if (body.regions.empty() || body.regions.front()->inside_share(X) == 1) points.push_back(X);
  }
}

ReferenceScene load_reference_scene(const fs::path& folder) {
  ReferenceScene scene;
  scene.name = folder.filename().string();
  ComparedScene& given = scene.given;
  given.body = load_body(load_scene(folder / "scene.toml"));
  read_vectors(folder / "landmarks.csv", given.landmarks, scene.displacements);
  read_vectors(folder / "field.csv", given.points, scene.field);
  read_vectors(folder / "targets.csv", given.points, scene.targets);
  fill_gland(given.body, given.points);
  scene.group = group_of(given.body, folder);
  return scene;
}

std::vector<fs::path> find_reference_scenes(const fs::path& references) {
  const std::string fix = "; --references takes the folder tests/reference of the sources";
  std::error_code error;
  std::vector<fs::path> folders;
  for (fs::directory_iterator entry(references, error), end; !error && entry != end; entry.increment(error))
    if (fs::exists(entry->path() / "scene.toml")) folders.push_back(entry->path());
  if (error) throw UserError(references.string() + ": " + error.message() + fix);
  if (folders.empty()) throw UserError(references.string() + ": holds no folder with a scene.toml" + fix);
  std::ranges::sort(folders);
  return folders;
}

fs::path default_references() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  fs::path installed = program.parent_path().parent_path() / "share/brachy/reference";
  if (!error && fs::is_directory(installed, error)) return installed;
  return fs::path(BRACHY_SOURCE_DIR) / "tests/reference";
}

}  // namespace brachy
