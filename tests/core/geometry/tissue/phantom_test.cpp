#include "core/geometry/tissue/phantom.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "core/geometry/surface/surface_check.h"
#include "core/geometry/tissue/interior_points.h"
#include "core/geometry/tissue/tissue.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"

namespace brachy {
namespace {

using namespace test;

SurfaceReport report_of(const SurfaceMesh& mesh) {
  return prepare_surface(mesh, {}, "phantom").report;
}

/// Where the ray from the origin along d leaves the surface, mm.
double radius(const SurfaceBvh& bvh, const Vec3& d) {
  const auto hit = bvh.first_hit(Vec3::Zero(), 100 * d.normalized());
  return hit ? 100 * hit->t : 0;
}

TEST(Phantom, HasExactlyTheVerticesAskedForAndIsClosed) {
  for (const std::size_t n : {50u, 51u, 77u, 123u, 500u, 1199u, 1200u, 1201u, 5000u, 20000u}) {
    const SurfaceMesh mesh = prostate_phantom(n);
    EXPECT_EQ(mesh.vertices.size(), n);
    const SurfaceReport report = report_of(mesh);
    EXPECT_EQ(report.vertices, n);
    EXPECT_EQ(report.triangles, 2 * n - 4) << n;  // genus 0: V − E + F = 2 with 2 E = 3 F
    EXPECT_EQ(report.bad_edges, 0u) << n;
    EXPECT_EQ(report.components, 1u) << n;
    EXPECT_EQ(report.flipped_triangles, 0u) << n;  // outward as it comes
    EXPECT_EQ(report.duplicate_triangles + report.degenerate_triangles, 0u) << n;
  }
  EXPECT_EQ(prostate_phantom().vertices.size(), 1200u);
}

TEST(Phantom, MakesTheScenesPoints) {
  const SurfaceMesh mesh = prepare_surface(prostate_phantom(), {}, "phantom").mesh;
  const Tissue tissue = build_tissue(mesh, fill_interior(SurfaceBvh(mesh), 13'360, 1));
  EXPECT_EQ(tissue.surface_count, 1200u);
  EXPECT_EQ(tissue.size(), 14'560u);
}

TEST(Phantom, HasTheClinicalSizeCentredAtTheOrigin) {
  for (const std::size_t n : {50u, 1200u, 7777u}) {
    const SurfaceReport report = report_of(prostate_phantom(n));
    EXPECT_LT((report.max_mm - Vec3(25, 20, 22.5)).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT((report.min_mm + Vec3(25, 20, 22.5)).cwiseAbs().maxCoeff(), 1e-9);
  }
  const double volume_cc = report_of(prostate_phantom()).volume_cc;
  EXPECT_GT(volume_cc, 40);
  EXPECT_LT(volume_cc, 55);
}

TEST(Phantom, IsStarShapedWithWellShapedTriangles) {
  for (const std::size_t n : {1200u, 20000u}) {
    const SurfaceMesh mesh = prostate_phantom(n);
    double smallest_angle = 180, shortest = 1e300, longest = 0;
    for (const Triangle& t : mesh.triangles) {
      EXPECT_GT(mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])), 0);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 a = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]];
        const Vec3 b = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[t[k]];
        smallest_angle = std::min(smallest_angle, std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / M_PI);
        shortest = std::min(shortest, a.norm());
        longest = std::max(longest, a.norm());
      }
    }
    EXPECT_GT(smallest_angle, 30) << n;
    EXPECT_LT(longest / shortest, 2.5) << n;
  }
}

TEST(Phantom, IsSmooth) {
  // No edge of a fine mesh folds by more than the curvature of its tightest rounding allows.
  const SurfaceMesh mesh = prostate_phantom(20'000);
  const SurfaceBvh bvh(mesh);
  double sharpest = 1;
  for (const Triangle& t : mesh.triangles) {
    const Vec3 n = (mesh.vertices[t[1]] - mesh.vertices[t[0]])
                       .cross(mesh.vertices[t[2]] - mesh.vertices[t[0]])
                       .normalized();
    for (const std::uint32_t v : t)
      sharpest = std::min(sharpest, n.dot(bvh.closest_point(mesh.vertices[v]).normal));
  }
  EXPECT_GT(sharpest, std::cos(8 * M_PI / 180));
}

TEST(Phantom, IsNoEllipsoid) {
  // The least-squares ellipsoid with the axes along x, y, z: Σ a_k x_k² + b_k x_k = 1.
  const SurfaceMesh mesh = prostate_phantom();
  Eigen::MatrixXd rows(mesh.vertices.size(), 6);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    rows.row(static_cast<Eigen::Index>(v)) << mesh.vertices[v].cwiseAbs2().transpose(),
        mesh.vertices[v].transpose();
  }
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(rows.rows());
  // By its normal equations: GCC takes seconds for a QR factorisation.
  const Eigen::MatrixXd normal = rows.transpose() * rows;
  const Eigen::VectorXd fit = normal.llt().solve(rows.transpose() * one);
  const Eigen::VectorXd residual = rows * fit - one;  // about twice the relative error of the radius
  EXPECT_GT(std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size())), 0.08);
  EXPECT_GT(residual.cwiseAbs().maxCoeff(), 0.25);
}

TEST(Phantom, TapersToTheApexAndIsBroadAtTheBase) {
  const SurfaceBvh bvh(prostate_phantom());
  const auto width = [&](double z) {
    std::array<SurfaceHit, 8> hits;
    const std::size_t n = bvh.all_hits(Vec3(-50, 2, z), Vec3(50, 2, z), hits);
    return n < 2 ? 0 : hits[n - 1].point.x() - hits[0].point.x();
  };
  EXPECT_GT(width(15), 1.7 * width(-15));
  EXPECT_GT(width(5), width(-5));
  EXPECT_GT(width(-5), width(-12));
  EXPECT_GT(width(-12), width(-20));
}

TEST(Phantom, HasAFlatBackWithASulcusAndAHollowAtTheBladderNeck) {
  const SurfaceBvh bvh(prostate_phantom(5000));
  const auto back = [&](double x) { return -bvh.first_hit(Vec3(x, -50, 3), Vec3(x, 0, 3))->point.y(); };
  const auto front = [&](double x) { return bvh.first_hit(Vec3(x, 50, 3), Vec3(x, 0, 3))->point.y(); };
  EXPECT_GT(back(7), back(0) + 0.5);                            // the sulcus
  EXPECT_LT(back(7), back(0) + 4);                              // shallow
  EXPECT_LT(back(7) - back(12), 0.5 * (front(0) - front(12)));  // flatter than the front
  const auto base = [&](double x) { return bvh.first_hit(Vec3(x, 1, 50), Vec3(x, 1, 0))->point.z(); };
  EXPECT_GT(base(8), base(0) + 0.5);
  EXPECT_LT(base(8), base(0) + 4);
  EXPECT_NEAR(radius(bvh, {1, 0, 0.2}), radius(bvh, {-1, 0, 0.2}), 0.2);  // left as right
}

TEST(Phantom, RefusesCountsItCannotMesh) {
  for (const std::size_t n : {std::size_t{0}, std::size_t{49}, std::size_t{1'000'001}, ~std::size_t{0}}) {
    user_error([&] { prostate_phantom(n); });
  }
}

}  // namespace
}  // namespace brachy
