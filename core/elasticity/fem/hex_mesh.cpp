#include "core/elasticity/fem/hex_mesh.h"

#include <algorithm>
#include <cmath>

namespace brachy {
namespace {

constexpr std::size_t kBoundsPatches = 400;  // of a region's surface, to find its bounding box

struct Bounds {
  Vec3 min, max;
};

// Of the regions inside the box; without one, the middle half of the box.
Bounds region_bounds(const ElasticBody& body) {
  const Bounds box = {body.box_centre - 0.5 * body.box_size, body.box_centre + 0.5 * body.box_size};
  Bounds bounds = {box.max, box.min};
  for (const auto& region : body.regions)
    for (const SurfacePatch& patch : region->surface(kBoundsPatches)) {
      const Vec3 p = patch.position.cwiseMax(box.min).cwiseMin(box.max);
      bounds.min = bounds.min.cwiseMin(p);
      bounds.max = bounds.max.cwiseMax(p);
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

}  // namespace

MeshPlanes mesh_planes(const ElasticBody& body, const MeshSizes& sizes) {
  const Bounds core = region_bounds(body);
  const double cell = std::cbrt((core.max - core.min).prod() / sizes.core_cells),
               margin = sizes.margin * cell;
  MeshPlanes planes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double half = 0.5 * body.box_size[k], centre = body.box_centre[k];
    planes[axis] = planes_along(centre - half, centre + half, std::max(core.min[k] - margin, centre - half),
                                std::min(core.max[k] + margin, centre + half), cell, sizes.growth);
  }
  return planes;
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
