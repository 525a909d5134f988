#include "core/elasticity/fem/hex_mesh.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr std::size_t kBoundsPatches = 400;  // of a region's surface, to find its bounding box

// Of the regions inside the box that have another modulus, or of all; without one, the middle half of the box.
MeshBounds region_bounds(const ElasticBody& body) {
  const MeshBounds box = {body.box_centre - 0.5 * body.box_size, body.box_centre + 0.5 * body.box_size};
  MeshBounds bounds = {box.max, box.min};
  const auto differs = [&](const auto& region) { return region->shear_modulus != body.shear_modulus; };
  const bool any_differs = std::ranges::any_of(body.regions, differs);
  for (const auto& region : body.regions) {
    if (any_differs && !differs(region)) continue;
    for (const SurfacePatch& patch : region->surface(kBoundsPatches)) {
      const Vec3 p = patch.position.cwiseMax(box.min).cwiseMin(box.max);
      bounds.min = bounds.min.cwiseMin(p);
      bounds.max = bounds.max.cwiseMax(p);
    }
  }
  if ((bounds.max - bounds.min).minCoeff() <= 0)
    return {body.box_centre - 0.25 * body.box_size, body.box_centre + 0.25 * body.box_size};
  return bounds;
}

// Steps that fill `length`, the first at most `first`, growing.
std::vector<double> growing_steps(double first, double length, double growth) {
  std::vector<double> steps;
  double total = 0;
  for (double step = first; total < 0.999 * length; step *= growth) {
    steps.push_back(step);
    total += step;
  }
  for (double& step : steps) step *= length / total;
  return steps;
}

std::vector<double> planes_along(double wall_min, double wall_max, double min, double max, double cell,
                                 double growth) {
  if (min - wall_min < 0.5 * cell) min = wall_min;
  if (wall_max - max < 0.5 * cell) max = wall_max;
  const int cells = std::max(1, static_cast<int>(std::ceil((max - min) / cell - 1e-9)));
  const double step = (max - min) / cells;
  std::vector<double> planes;
  double x = min;
  for (const double s : growing_steps(step, min - wall_min, growth)) planes.push_back(x -= s);
  std::ranges::reverse(planes);
  for (int i = 0; i <= cells; ++i) planes.push_back(min + i * step);
  x = max;
  for (const double s : growing_steps(step, wall_max - max, growth)) planes.push_back(x += s);
  planes.front() = wall_min;
  planes.back() = wall_max;
  return planes;
}

MeshPlanes planes_of(const ElasticBody& body, const MeshBounds& core, const Vec3& cell, double margin,
                     double growth) {
  MeshPlanes planes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double half = 0.5 * body.box_size[k], centre = body.box_centre[k];
    planes[axis] =
        planes_along(centre - half, centre + half, std::max(core.min[k] - margin * cell[k], centre - half),
                     std::min(core.max[k] + margin * cell[k], centre + half), cell[k], growth);
  }
  return planes;
}

// Rows of a system over so many nodes times its half band: multiply-adds of one triangular solve.
double solve_work(std::array<double, 3> nodes) {
  std::ranges::sort(nodes);
  return 3 * nodes[0] * nodes[1] * nodes[2] * 3 * (nodes[0] * nodes[1] + nodes[0] + 1);
}

}  // namespace

// A column takes half a forward and half a backward solve among nodes inside the walls, and one and a half among all
// nodes, where the walls move.
double table_work(const MeshPlanes& planes, const MeshBounds& tissue) {
  double columns = 3;
  std::array<double, 3> all{}, inside{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const auto count = static_cast<double>(planes[axis].size());
    const auto within =
        std::ranges::count_if(planes[axis], [&](double x) { return x > tissue.min[k] && x < tissue.max[k]; });
    columns *= std::min(count, static_cast<double>(within) + 2);
    all[axis] = count;
    inside[axis] = std::max(1.0, count - 2);
  }
  return columns * (solve_work(inside) + 1.5 * solve_work(all));
}

MeshPlanes mesh_planes(const ElasticBody& body, const MeshSizes& sizes,
                       const std::optional<MeshBounds>& tissue_bounds) {
  const MeshBounds core = region_bounds(body);
  const Vec3 half = 0.25 * body.box_size;
  const MeshBounds tissue = tissue_bounds.value_or(
      MeshBounds{core.min.cwiseMin(body.box_centre - half), core.max.cwiseMax(body.box_centre + half)});
  const double volume = (core.max - core.min).prod(), widest = std::cbrt(volume / sizes.least_cells);
  Vec3 cell = Vec3::Constant(std::cbrt(volume / sizes.core_cells));
  const auto is_within = [&](const MeshPlanes& planes) {
    return table_work(planes, tissue) <= sizes.max_work;
  };
  constexpr double kCoarser = 1.04, kFaster = 1.05, kMaxGrowth = 8;
  // One axis after the other, so that a step takes no more than it has to.
  for (Eigen::Index axis = 0;; axis = (axis + 1) % 3) {
    for (double g = sizes.growth; g < sizes.coarse_growth; g *= kFaster)
      if (MeshPlanes planes = planes_of(body, core, cell, sizes.margin, g); is_within(planes)) return planes;
    if (cell[axis] >= widest) break;
    cell[axis] *= kCoarser;
  }
  for (double growth = sizes.coarse_growth; growth < kMaxGrowth; growth *= kFaster)
    if (MeshPlanes planes = planes_of(body, core, cell, sizes.margin, growth); is_within(planes))
      return planes;
  throw UserError(
      "[[region]]: finite elements would take minutes to set up, because the regions together are long and "
      "thin in "
      "this [box]; leave out shear_modulus_kpa of some of them, make box.size_mm smaller, or choose kernel = "
      "\"psi31\"");
}

MeshPlanes with_outer_cells(MeshPlanes planes) {
  for (std::vector<double>& p : planes) {
    p.insert(p.begin(), 2 * p[0] - p[1]);
    p.push_back(2 * p[p.size() - 1] - p[p.size() - 2]);
  }
  return planes;
}

HexMesh::HexMesh(MeshPlanes planes) : planes_(std::move(planes)), by_stride_{0, 1, 2} {
  std::ranges::stable_sort(by_stride_, {}, [&](std::size_t axis) { return planes_[axis].size(); });
  int stride = 1;
  for (const std::size_t axis : by_stride_) {
    stride_[axis] = stride;
    stride *= static_cast<int>(planes_[axis].size());
  }
  slowest_ = by_stride_[2];
}

HexMesh::Place HexMesh::place(int node) const {
  Place p{};
  for (const std::size_t axis : by_stride_) p[axis] = node / stride_[axis] % planes(axis);
  return p;
}

HexMesh::Shape HexMesh::shape(const Vec3& X) const {
  Place cell{};
  Vec3 t;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::vector<double>& p = planes_[axis];
    const double x = std::clamp(X[static_cast<Eigen::Index>(axis)], p.front(), p.back());
    const auto above = std::upper_bound(p.begin() + 1, p.end() - 1, x);
    cell[axis] = static_cast<int>(above - p.begin()) - 1;
    t[static_cast<Eigen::Index>(axis)] = (x - above[-1]) / (above[0] - above[-1]);
  }
  Shape shape;
  for (int a = 0; a < 8; ++a) {
    shape.node[static_cast<std::size_t>(a)] = cell_node(cell, a);
    double share = 1;
    for (int k = 0; k < 3; ++k) share *= a >> k & 1 ? t[k] : 1 - t[k];
    shape.share[static_cast<std::size_t>(a)] = share;
  }
  return shape;
}

// With b_a = ∇N_a and its mean m_a over the cell: deviatoric part of B from b, dilatation from m.
//     K_ab = Σ_g w_g [ (b_a·b_b) I + b_b b_aᵀ − ⅔ b_a b_bᵀ + κ m_a m_bᵀ ],   κ = λ + ⅔ = 2ν/(1−2ν) + ⅔
Eigen::Matrix<double, 24, 24> hex_stiffness(const Vec3& size, double poisson,
                                            const std::array<double, 8>& modulus) {
  using Gradients = Eigen::Matrix<double, 3, 8>;
  const double bulk = 2 * poisson / (1 - 2 * poisson) + 2.0 / 3, volume = size.prod();
  const double gauss[2] = {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)};
  std::array<Gradients, 8> gradients;
  Gradients mean = Gradients::Zero();
  for (int g = 0; g < 8; ++g) {
    Gradients& b = gradients[static_cast<std::size_t>(g)];
    for (int a = 0; a < 8; ++a) {
      Vec3 value, slope;
      for (int k = 0; k < 3; ++k) {
        const double t = gauss[g >> k & 1];
        value[k] = a >> k & 1 ? t : 1 - t;
        slope[k] = (a >> k & 1 ? 1 : -1) / size[k];
      }
      b.col(a) = Vec3(slope[0] * value[1] * value[2], value[0] * slope[1] * value[2],
                      value[0] * value[1] * slope[2]);
    }
    mean += b / 8;
  }
  Eigen::Matrix<double, 24, 24> K = Eigen::Matrix<double, 24, 24>::Zero();
  for (std::size_t g = 0; g < 8; ++g) {
    const Gradients& b = gradients[g];
    const double w = modulus[g] * volume / 8;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        Mat3 k = b.col(j) * b.col(i).transpose() - 2.0 / 3 * b.col(i) * b.col(j).transpose() +
                 bulk * mean.col(i) * mean.col(j).transpose();
        k.diagonal().array() += b.col(i).dot(b.col(j));
        K.block<3, 3>(3 * i, 3 * j) += w * k;
      }
  }
  return K;
}

}  // namespace brachy
