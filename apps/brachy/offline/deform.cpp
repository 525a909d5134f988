#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>

#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/landmarks/landmark_field.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/mesh_io/ply_writer.h"
#include "core/geometry/surface/surface_check.h"
#include "core/models/matrix_kernel/matrix_models.h"

namespace brachy {
namespace {

struct DeformOptions : LandmarkFieldOptions {
  std::optional<std::filesystem::path> points, mesh;  ///< exactly one
  std::filesystem::path out;
  bool jacobian = false;
  bool strict = false;
  bool json = false;
  bool force = false;
};

void write_rows(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(file, ignored)) std::filesystem::remove(file, ignored);
    throw UserError(file.string() + ": cannot be written; check the folder and the free space");
  }
}

constexpr std::size_t kPointsAtOnce = 20'000;  // between two progress updates

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
  write_rows(options.out, text);
}

int deform_points(const DeformOptions& options) {
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

int run(const DeformOptions& options) {
  if (!options.points && !options.mesh) throw UsageError("needs --points FILE or --mesh FILE");
  try {
    return deform_points(options);
  } catch (const Refused& e) {
    std::cerr << "brachy: refused: " << e.what() << "\n";
    return kExitRefused;
  }
}

void declare(OptionList& list, DeformOptions& options) {
  list.add("--landmarks", options.landmarks, "CSV x,y,z,dx,dy,dz[,core_mm][,support]").required();
  const Option points = list.add("--points", options.points, "CSV x,y,z");
  points.excludes(list.add("--mesh", options.mesh, "STL, OBJ or PLY; --out is then a PLY"));
  list.add("--scene", options.scene, "body, moduli, regions and their supports, needle and kernel (TOML)");
  list.add("--kernel", options.kernel, "deformation model; default: the scene's, or psi31")
      .one_of(all_model_names());
  list.add("--support", options.support_mm,
           "support radius a of a psi kernel, mm; largest one of a compact model (default 48)")
      .range(1e-6, 1e6);
  list.add("--poisson", options.poisson, "Poisson's ratio; default: the scene's, or 0.49").range(0.0, 0.4995);
  list.add("--shear-modulus-kpa", options.shear_modulus_kpa, "of the tissue; default: the scene's, or 6")
      .range(1e-3, 1e6);
  list.add("--core-radius", options.core_radius_mm, "of every landmark without a core_mm, mm")
      .range(1e-3, 1e3);
  list.add_output("--out", options.out, "file to write").required();
  list.add_flag("--jacobian", options.jacobian, "also write det(I + ∇u)");
  list.add_flag("--strict", options.strict, "refuse a field that folds at a point");
  list.add_force(options.force);
  list.add_flag("--json", options.json, "print the result as JSON");
}

}  // namespace

Tool deform_tool() {
  return make_tool<DeformOptions>("deform",
                                  "Deform points or a mesh by landmarks, exactly and without a clock.",
                                  R"(Examples:
  brachy deform --landmarks L.csv --points P.csv --kernel psi31 --support 12 --out O.csv
  brachy deform --landmarks L.csv --points P.csv --scene scene.toml --kernel elastic --out O.csv
  brachy deform --landmarks L.csv --mesh M.stl --kernel elastic --poisson 0.49 --core-radius 2 --out O.ply
Landmarks: x,y,z,dx,dy,dz[,core_mm][,support] (an anchor has zeros). Points: x,y,z. Out:
x,y,z,dx,dy,dz[,det]. mm.
elastic and fem treat landmarks that follow each other along a line as a needle's shaft of the scene's radius
and a single one as a contact; a core_mm > 0 makes a landmark a point of that core radius instead.
A column support gives every landmark a support radius of its own (psi kernels), as the paper has it, for
comparison: nothing guarantees that such a system is regular, and it is refused where its condition number is
above 1e12.
Without --scene, elastic is an unbounded solid and needs a core radius; fem needs a scene.
Exit codes: 0 done, 2 bad input, 3 refused (singular or contradictory landmarks; with --strict, folding).)",
                                  declare, run);
}

}  // namespace brachy
