#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/tools.h"
#include "core/error.h"
#include "core/mesh_io/mesh_file.h"
#include "core/mesh_io/ply_writer.h"
#include "core/number_csv.h"
#include "core/rbf/rbf_field.h"
#include "core/rbf/rbf_system.h"
#include "core/surface/surface_check.h"

namespace brachy {
namespace {

/// The landmarks are well-formed, but no field can be had from them: exit code 3.
class Refused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Landmarks {
  std::vector<Vec3> positions, displacements;
  std::vector<std::size_t> lines;
};

Vec3 vec3(std::span<const double> row, std::size_t first) {
  return {row[first], row[first + 1], row[first + 2]};
}

Landmarks load_landmarks(const std::filesystem::path& file) {
  const NumberTable table = load_number_csv(file, "x,y,z,dx,dy,dz", {.max_rows = 20'000});
  Landmarks landmarks;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    landmarks.positions.push_back(vec3(table.row(i), 0));
    landmarks.displacements.push_back(vec3(table.row(i), 3));
    landmarks.lines.push_back(table.lines[i]);
  }
  return landmarks;
}

/// Of landmarks that are one to the solver, the later is dropped if both say the same; otherwise they contradict.
void merge_duplicates(Landmarks& landmarks, double support, const std::string& name) {
  Landmarks kept;
  for (std::size_t i = 0; i < landmarks.positions.size(); ++i) {
    bool merged = false;
    for (std::size_t j = 0; j < kept.positions.size() && !merged; ++j) {
      if ((kept.positions[j] - landmarks.positions[i]).norm() >= RbfSystem::kDuplicateDistance * support)
        continue;
      const double differ = (kept.displacements[j] - landmarks.displacements[i]).norm();
      if (differ > RbfSystem::kDuplicateDistance * support)
        throw Refused(
            fmt::format("{}:{}: contradicts line {}: the same place is displaced by {:g} mm more or less; "
                        "remove one of them",
                        name, landmarks.lines[i], kept.lines[j], differ));
      std::cerr << fmt::format("brachy: {}:{}: merged with line {}, which says the same\n", name,
                               landmarks.lines[i], kept.lines[j]);
      merged = true;
    }
    if (merged) continue;
    kept.positions.push_back(landmarks.positions[i]);
    kept.displacements.push_back(landmarks.displacements[i]);
    kept.lines.push_back(landmarks.lines[i]);
  }
  landmarks = std::move(kept);
}

std::vector<Vec3> solve(const Landmarks& landmarks, const Kernel& kernel, double support,
                        const std::string& name) {
  RbfSystem system(kernel, support, static_cast<int>(landmarks.positions.size()));
  if (!system.factorize(landmarks.positions))
    throw Refused(name +
                  ": the landmark system is singular to rounding: landmarks lie too close together for " +
                  std::string(name_of(kernel)) + fmt::format(" at --support {:g}", support) +
                  "; lower --support, take psi30, or thin them out");
  std::vector<Vec3> weights(landmarks.positions.size());
  system.solve(landmarks.displacements, weights);
  for (const Vec3& w : weights)
    if (!w.allFinite()) throw Refused(name + ": the weights overflow; are the displacements in mm?");
  return weights;
}

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file, ignored)) std::filesystem::remove(file, ignored);
    throw UserError(file.string() + ": cannot be written; check the folder and the free space");
  }
}

struct Result {
  std::size_t points = 0, moved = 0, folded = 0;
  double max_displacement_mm = 0, min_det = 1;
  std::string first_fold;
};

Result summarize(const std::vector<Vec3>& points, const std::vector<Vec3>& u,
                 const std::vector<double>& det) {
  Result result;
  result.points = points.size();
  for (std::size_t i = 0; i < points.size(); ++i) {
    result.moved += u[i] != Vec3::Zero();
    result.max_displacement_mm = std::max(result.max_displacement_mm, u[i].norm());
    if (i == 0) result.min_det = det[0];
    result.min_det = std::min(result.min_det, det[i]);
    if (det[i] <= 0 && result.folded++ == 0)
      result.first_fold = fmt::format("({:g}, {:g}, {:g})", points[i].x(), points[i].y(), points[i].z());
  }
  return result;
}

void write_points(const DeformOptions& options, const std::vector<Vec3>& points, const std::vector<Vec3>& u,
                  const std::vector<double>& det) {
  std::string text = options.jacobian ? "x,y,z,dx,dy,dz,det\n" : "x,y,z,dx,dy,dz\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double row[] = {points[i].x(), points[i].y(), points[i].z(), u[i].x(), u[i].y(), u[i].z(), det[i]};
    append_csv_row(text, {row, options.jacobian ? 7u : 6u});
    text += '\n';
  }
  write_text(options.out, text);
}

int run(const DeformOptions& options) {
  const std::string name = options.landmarks.string();
  const Kernel kernel = *find_kernel(options.kernel);
  Landmarks landmarks = load_landmarks(options.landmarks);
  merge_duplicates(landmarks, options.support_mm, name);
  const std::vector<Vec3> weights = solve(landmarks, kernel, options.support_mm, name);
  const RbfField field{kernel, options.support_mm, landmarks.positions, weights};

  SurfaceMesh mesh;
  std::vector<Vec3> points;
  if (options.mesh) {
    mesh =
        prepare_surface(read_mesh_file(*options.mesh), {.min_island_share = 0}, options.mesh->string()).mesh;
    points = mesh.vertices;
  } else {
    const NumberTable table = load_number_csv(*options.points, "x,y,z");
    for (std::size_t i = 0; i < table.rows(); ++i) points.push_back(vec3(table.row(i), 0));
  }
  std::vector<Vec3> u;
  std::vector<double> det;
  for (const Vec3& X : points) {
    u.push_back(field.displacement(X));
    det.push_back(field.jacobian(X));
  }

  const Result result = summarize(points, u, det);
  if (result.folded) {
    const std::string what = fmt::format("the field folds (det ≤ 0) at {} of {} points, first at {}",
                                         result.folded, result.points, result.first_fold);
    if (options.strict) throw Refused(what + "; raise --support or displace less");
    std::cerr << "brachy: " << what << "\n";
  }
  if (options.mesh) {
    for (std::size_t i = 0; i < points.size(); ++i) mesh.vertices[i] = points[i] + u[i];
    write_ply(options.out, mesh, options.jacobian ? PlyVertexProperty{"det", det} : PlyVertexProperty{});
  } else {
    write_points(options, points, u, det);
  }

  if (options.json) {
    const nlohmann::ordered_json json = {
        {"landmarks", landmarks.positions.size()},   {"points", result.points},   {"moved", result.moved},
        {"max_disp_mm", result.max_displacement_mm}, {"min_det", result.min_det}, {"folded", result.folded}};
    std::cout << json.dump() << "\n";
  } else {
    std::cout << fmt::format("{}: {} of {} points moved, by up to {:.4g} mm; least det {:.4g}\n",
                             options.out.string(), result.moved, result.points, result.max_displacement_mm,
                             result.min_det);
  }
  return kExitOk;
}

}  // namespace

int deform(const DeformOptions& options) {
  try {
    return run(options);
  } catch (const Refused& e) {
    std::cerr << "brachy: refused: " << e.what() << "\n";
    return kExitRefused;
  }
}

}  // namespace brachy
