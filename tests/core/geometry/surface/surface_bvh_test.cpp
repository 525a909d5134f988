#include "core/geometry/surface/surface_bvh.h"

#include <gtest/gtest.h>

#include <random>
#include <type_traits>

#include "core/geometry/mesh_io/mesh_file.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/data_dir.h"

namespace brachy {
namespace {

using namespace test;

class RandomPoints {
 public:
  RandomPoints(const SurfaceBvh& bvh, std::uint64_t seed) : random_(seed), bvh_(bvh) {}
  /// In the bounding box, a tenth larger each way.
  Vec3 next() {
    std::uniform_real_distribution<double> share(-0.1, 1.1);
    const Vec3 s(share(random_), share(random_), share(random_));
    return bvh_.min() + s.cwiseProduct(bvh_.max() - bvh_.min());
  }

 private:
  std::mt19937_64 random_;
  const SurfaceBvh& bvh_;
};

/// All crossings by Möller–Trumbore over every triangle, sorted; queries in general position only.
std::vector<std::pair<double, std::uint32_t>> brute_force_hits(const SurfaceMesh& mesh, const Vec3& a,
                                                               const Vec3& b) {
  std::vector<std::pair<double, std::uint32_t>> hits;
  const Vec3 d = b - a;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vec3 &p = mesh.vertices[mesh.triangles[i][0]], q = mesh.vertices[mesh.triangles[i][1]] - p,
               r = mesh.vertices[mesh.triangles[i][2]] - p;
    const double det = q.dot(d.cross(r));
    const double u = (a - p).dot(d.cross(r)) / det, v = d.dot((a - p).cross(q)) / det;
    const double t = r.dot((a - p).cross(q)) / det;
    if (u >= 0 && v >= 0 && u + v <= 1 && t >= 0 && t <= 1) hits.emplace_back(t, i);
  }
  std::sort(hits.begin(), hits.end());
  return hits;
}

/// Distance to a triangle by another method: its plane where p projects inside, else its three edges.
double triangle_distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto edge = [&](const Vec3& u, const Vec3& v) {
    const double s = std::clamp((p - u).dot(v - u) / (v - u).squaredNorm(), 0.0, 1.0);
    return (u + s * (v - u) - p).norm();
  };
  const Vec3 n = (b - a).cross(c - a);
  const bool over = (b - a).cross(p - a).dot(n) >= 0 && (c - b).cross(p - b).dot(n) >= 0 &&
                    (a - c).cross(p - c).dot(n) >= 0;
  return over ? std::abs((p - a).dot(n)) / n.norm() : std::min({edge(a, b), edge(b, c), edge(c, a)});
}

void expect_equals_brute_force(const SurfaceBvh& bvh, std::size_t queries) {
  const SurfaceMesh& mesh = bvh.mesh();
  RandomPoints points(bvh, 42);
  std::size_t crossings = 0, inside_count = 0;
  for (std::size_t i = 0; i < queries; ++i) {
    const Vec3 a = points.next(), b = points.next();
    const auto expected = brute_force_hits(mesh, a, b);
    std::array<SurfaceHit, 64> hits;
    ASSERT_EQ(bvh.all_hits(a, b, hits), expected.size());
    const auto first = bvh.first_hit(a, b);
    ASSERT_EQ(first.has_value(), !expected.empty());
    const bool inside = bvh.inside(a);
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_EQ(hits[k].triangle, expected[k].second);
      EXPECT_NEAR(hits[k].t, expected[k].first, 1e-11);
      EXPECT_LT((hits[k].point - (a + hits[k].t * (b - a))).norm(), 1e-9);
      EXPECT_EQ(hits[k].entering, hits[k].normal.dot(b - a) < 0);
      EXPECT_EQ(hits[k].entering, inside == (k % 2 == 1));  // inside and outside alternate
      EXPECT_NEAR(hits[k].normal.norm(), 1, 1e-14);
    }
    EXPECT_EQ(bvh.inside(b), inside != (expected.size() % 2 == 1));
    if (first) {
      EXPECT_EQ(first->triangle, expected[0].second);
      EXPECT_EQ(first->t, hits[0].t);
      EXPECT_EQ(first->entering, !inside);
    }
    double distance = 1e300;
    for (const Triangle& t : mesh.triangles) {
      distance = std::min(
          distance, triangle_distance(a, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
    }
    const ClosestPoint closest = bvh.closest_point(a);
    EXPECT_NEAR(std::abs(closest.signed_distance), distance, 1e-10);
    EXPECT_NEAR((closest.point - a).norm(), distance, 1e-10);
    EXPECT_EQ(closest.signed_distance < 0, inside);
    EXPECT_NEAR(closest.normal.norm(), 1, 1e-14);
    crossings += expected.size();
    inside_count += inside;
  }
  EXPECT_GT(crossings, queries / 2);  // the queries are not trivial
  EXPECT_GT(inside_count, queries / 10);
}

TEST(SurfaceBvh, EqualsBruteForceOnThePhantom) {
  expect_equals_brute_force(SurfaceBvh(prepare_surface(prostate_phantom(), {}, "phantom").mesh), 2000);
}

TEST(SurfaceBvh, EqualsBruteForceOnAConcaveLiver) {
  BRACHY_REQUIRE_DATA(data);
  const SurfaceMesh mesh = read_mesh_file(data / "meshes/liver_concave.ply");
  expect_equals_brute_force(SurfaceBvh(prepare_surface(mesh, {}, "liver").mesh), 1500);
}

TEST(SurfaceBvh, SegmentThroughAnEdgeDoesNotSlipThrough) {
  const SurfaceBvh bvh(prostate_phantom());
  std::array<SurfaceHit, 8> hits;
  for (const Triangle& t : bvh.mesh().triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 edge = 0.5 * (bvh.mesh().vertices[t[k]] + bvh.mesh().vertices[t[(k + 1) % 3]]);
      // Star-shaped: a ray from the centre crosses once.
      ASSERT_EQ(bvh.all_hits(Vec3::Zero(), 2 * edge, hits), 1u);
      EXPECT_NEAR(hits[0].t, 0.5, 1e-9);
      EXPECT_FALSE(hits[0].entering);
      ASSERT_TRUE(bvh.first_hit(2 * edge, Vec3::Zero()));
      EXPECT_TRUE(bvh.first_hit(2 * edge, Vec3::Zero())->entering);
    }
  }
}

TEST(SurfaceBvh, SegmentThroughAVertexCrossesOnce) {
  const SurfaceBvh bvh(prostate_phantom());
  std::array<SurfaceHit, 8> hits;
  for (const Vec3& v : bvh.mesh().vertices) {
    ASSERT_EQ(bvh.all_hits(Vec3::Zero(), 2 * v, hits), 1u);
    EXPECT_NEAR(hits[0].t, 0.5, 1e-9);
    ASSERT_EQ(bvh.all_hits(2 * v, -0.01 * v, hits), 1u);
    EXPECT_TRUE(hits[0].entering);
  }
}

TEST(SurfaceBvh, ExactlyAlignedSegmentsOnABoxCrossTwice) {
  // Integer coordinates: every segment below meets edges, corners and diagonals exactly.
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  std::array<SurfaceHit, 8> hits;
  for (int x = 1; x < 4; ++x) {
    for (int y = 1; y < 4; ++y) {  // x = y lies on the faces' diagonals
      ASSERT_EQ(bvh.all_hits(Vec3(x, y, -1), Vec3(x, y, 5), hits), 2u) << x << " " << y;
      EXPECT_TRUE(hits[0].entering);
      EXPECT_FALSE(hits[1].entering);
      EXPECT_DOUBLE_EQ(hits[0].point.z(), 0);
      EXPECT_DOUBLE_EQ(hits[1].point.z(), 4);
      EXPECT_EQ(hits[0].normal, Vec3(0, 0, -1));
    }
  }
  for (const Vec3& d : {Vec3(1, 1, 1), Vec3(1, -1, 1), Vec3(-1, 1, 1), Vec3(1, 1, -1)}) {
    ASSERT_EQ(bvh.all_hits(Vec3(2, 2, 2) - 3 * d, Vec3(2, 2, 2) + 3 * d, hits), 2u);  // corner to corner
    EXPECT_TRUE(hits[0].entering);
    EXPECT_FALSE(hits[1].entering);
  }
}

TEST(SurfaceBvh, AGrazeIsNoCrossing) {
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  std::array<SurfaceHit, 8> hits;
  EXPECT_EQ(bvh.all_hits(Vec3(-1, 1, 2), Vec3(1, -1, 2), hits), 0u);   // across the edge x = y = 0
  EXPECT_EQ(bvh.all_hits(Vec3(-2, 1, 1), Vec3(2, -1, -1), hits), 0u);  // past the corner 0, 0, 0
}

TEST(SurfaceBvh, AFullBufferKeepsTheNearestHits) {
  SurfaceMesh row;
  for (int i = 0; i < 10; ++i) row = joined(row, make_box({2.0 * i, 0, 0}, {2.0 * i + 1, 1, 1}));
  const SurfaceBvh bvh(row);
  std::array<SurfaceHit, 5> hits;
  ASSERT_EQ(bvh.all_hits(Vec3(-1, 0.3, 0.4), Vec3(30, 0.3, 0.4), hits), 5u);
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(hits[k].point.x(), static_cast<double>(k), 1e-12);
  EXPECT_EQ(bvh.all_hits(Vec3(-1, 0.3, 0.4), Vec3(30, 0.3, 0.4), {}), 0u);
}

TEST(SurfaceBvh, EndsCountAndAreClampedAndWhatLiesBeyondDoesNot) {
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  const Vec3 outside(1, 2, -1), on(1, 2, 0), inside(1, 2, 1);
  EXPECT_EQ(bvh.first_hit(outside, on)->t, 1);
  EXPECT_EQ(bvh.first_hit(on, inside)->t, 0);
  EXPECT_TRUE(bvh.first_hit(outside, Vec3(1, 2, -1e-10)));  // within the slack
  EXPECT_EQ(bvh.first_hit(outside, Vec3(1, 2, -1e-10))->t, 1);
  EXPECT_FALSE(bvh.first_hit(outside, Vec3(1, 2, -1e-6)));
  EXPECT_FALSE(bvh.first_hit(Vec3(1, 2, 1e-6), inside));
  EXPECT_FALSE(bvh.first_hit(on, on));
}

TEST(SurfaceBvh, ConsecutiveStepsOfAPathNeverLoseACrossing) {
  const SurfaceBvh bvh(prostate_phantom());
  RandomPoints points(bvh, 5);
  for (int i = 0; i < 200; ++i) {
    // Steps that end on the surface, as far as doubles go.
    const Vec3 a = points.next(), b = points.next();
    const auto hit = bvh.first_hit(a, b);
    if (!hit) continue;
    EXPECT_TRUE(bvh.first_hit(a, hit->point) || bvh.first_hit(hit->point, b));
  }
}

TEST(SurfaceBvh, NearestFeatureGivesThePseudoNormal) {
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  const ClosestPoint face = bvh.closest_point({1, 2, -3});
  EXPECT_EQ(face.point, Vec3(1, 2, 0));
  EXPECT_EQ(face.normal, Vec3(0, 0, -1));
  EXPECT_EQ(face.signed_distance, 3);
  const ClosestPoint edge = bvh.closest_point({-1, -1, 2});
  EXPECT_EQ(edge.point, Vec3(0, 0, 2));
  EXPECT_TRUE(edge.normal.isApprox(Vec3(-1, -1, 0).normalized(), 1e-14));
  EXPECT_DOUBLE_EQ(edge.signed_distance, std::sqrt(2.0));
  const ClosestPoint corner = bvh.closest_point({5, 5, 5});
  EXPECT_EQ(corner.point, Vec3(4, 4, 4));
  EXPECT_TRUE(corner.normal.isApprox(Vec3(1, 1, 1).normalized(), 1e-14));  // whatever the triangulation
  EXPECT_DOUBLE_EQ(corner.signed_distance, std::sqrt(3.0));
  EXPECT_DOUBLE_EQ(bvh.closest_point({1, 2, 0.5}).signed_distance, -0.5);
}

TEST(SurfaceBvh, SignIsRightBesideAThinSpike) {
  // The nearest point is the spike's tip for points whose nearest face normals disagree on the side.
  SurfaceMesh spike = {{Vec3(0, 0, 10), Vec3(1, 0, 0), Vec3(-0.5, 0.8, 0), Vec3(-0.5, -0.8, 0)},
                       {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
  const SurfaceBvh bvh(spike);
  for (int i = 0; i < 64; ++i) {
    const double a = 2 * M_PI * i / 64;
    const Vec3 p(0.3 * std::cos(a), 0.3 * std::sin(a), 10.2);
    EXPECT_NEAR(bvh.closest_point(p).signed_distance, std::hypot(0.3, 0.2), 1e-12) << i;
    EXPECT_FALSE(bvh.inside(p));
  }
}

TEST(SurfaceBvh, ACavityIsOutside) {
  const SurfaceMesh shell = joined(make_box({0, 0, 0}, {10, 10, 10}), make_box({2, 2, 2}, {8, 8, 8}));
  const SurfaceBvh bvh(prepare_surface(shell, {}, "shell").mesh);
  for (const auto& [p, distance] : {std::pair(Vec3(5, 5, 5), 3.0), std::pair(Vec3(1, 5, 5), -1.0),
                                    std::pair(Vec3(1.7, 5, 5), -0.3), std::pair(Vec3(-1, 5, 5), 1.0)}) {
    EXPECT_NEAR(bvh.closest_point(p).signed_distance, distance, 1e-12);
    EXPECT_EQ(bvh.inside(p), distance < 0);
  }
}

TEST(SurfaceBvh, WhatIsNotFiniteHitsNothing) {
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  const Vec3 good(1, 2, 1);
  for (const double bad : {std::nan(""), double(INFINITY), -double(INFINITY)}) {
    for (int k = 0; k < 3; ++k) {
      Vec3 p = good;
      p[k] = bad;
      std::array<SurfaceHit, 4> hits;
      EXPECT_FALSE(bvh.first_hit(p, good));
      EXPECT_FALSE(bvh.first_hit(good, p));
      EXPECT_EQ(bvh.all_hits(good, p, hits), 0u);
      EXPECT_FALSE(bvh.inside(p));
      EXPECT_TRUE(std::isnan(bvh.closest_point(p).signed_distance));
    }
  }
}

TEST(SurfaceBvh, FarAndHugeQueriesStillAnswer) {
  const SurfaceBvh bvh(make_box({0, 0, 0}, {4, 4, 4}));
  EXPECT_TRUE(bvh.first_hit(Vec3(1e6, 1.5, 2.5), Vec3(-1e6, 1.5, 2.5)));
  EXPECT_NEAR(bvh.closest_point({1e6, 2, 2}).signed_distance, 1e6 - 4, 1e-6);
  EXPECT_FALSE(bvh.inside({1e300, 2, 2}));
}

TEST(SurfaceBvh, ManyTrianglesInOnePlaceBuildWithinTheDepth) {
  SurfaceMesh mesh;  // nested boxes that shrink to a point: the worst case of a spatial split
  for (int i = 0; i < 200; ++i) {
    const double s = std::pow(0.7, i);
    mesh = joined(mesh, make_box({-s, -s, -s}, {s, s, s}));
  }
  for (int i = 0; i < 1000; ++i) mesh = joined(mesh, make_box({-1, -1, -1}, {1, 1, 1}));  // and 1,000 alike
  const SurfaceBvh bvh(mesh);
  EXPECT_NEAR(bvh.closest_point({3, 0, 0}).signed_distance, 2, 1e-12);
  EXPECT_TRUE(bvh.first_hit({3, 0.1, 0.2}, {0, 0.1, 0.2}));
}

using Bvh = const SurfaceBvh&;
using Point = const Vec3&;
static_assert(noexcept(std::declval<Bvh>().first_hit(std::declval<Point>(), std::declval<Point>())));
static_assert(noexcept(std::declval<Bvh>().closest_point(std::declval<Point>())));
static_assert(noexcept(std::declval<Bvh>().inside(std::declval<Point>())));

}  // namespace
}  // namespace brachy
