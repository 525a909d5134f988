#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>

#include "apps/brachy/landmark_field.h"
#include "apps/brachy/tools.h"
#include "apps/terminal/progress.h"
#include "core/error.h"
#include "core/mesh_io/mesh_file.h"
#include "core/mesh_io/ply_writer.h"
#include "core/number_csv.h"
#include "core/surface/surface_check.h"

namespace brachy {
namespace {

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

constexpr std::size_t kPointsAtOnce = 20'000;  // between two looks at the progress

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
  const LandmarkField field(options);
  SurfaceMesh mesh;
  std::vector<Vec3> points;
  if (options.mesh) {
    mesh =
        prepare_surface(read_mesh_file(*options.mesh), {.min_island_share = 0}, options.mesh->string()).mesh;
    points = mesh.vertices;
  } else {
    const NumberTable table = load_number_csv(*options.points, "x,y,z");
    for (std::size_t i = 0; i < table.rows(); ++i)
      points.emplace_back(table.row(i)[0], table.row(i)[1], table.row(i)[2]);
  }
  std::vector<Vec3> u;
  std::vector<double> det;
  Progress progress("deform");
  for (std::size_t done = 0; done < points.size(); done = u.size()) {
    progress.show_step(done, points.size(), fmt::format("{} points", points.size()));
    const auto part = std::span(points).subspan(done, std::min(kPointsAtOnce, points.size() - done));
    std::ranges::copy(field.displacements(part), std::back_inserter(u));
    std::ranges::copy(field.jacobians(part), std::back_inserter(det));
  }
  progress.finish();

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
    nlohmann::ordered_json json = {
        {"landmarks", field.landmarks()}, {"points", result.points},
        {"moved", result.moved},          {"max_disp_mm", result.max_displacement_mm},
        {"min_det", result.min_det},      {"folded", result.folded},
        {"kernel", field.kernel()},       {"condition", field.condition()}};
    if (const auto force = field.total_force()) json["force_n"] = {force->x(), force->y(), force->z()};
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
