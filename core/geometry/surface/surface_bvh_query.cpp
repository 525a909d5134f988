#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/surface/segment_test.h"
#include "core/geometry/surface/surface_bvh.h"

namespace brachy {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double squared_distance_to_box(const Vec3& p, const Vec3& min, const Vec3& max) {
  return (min - p).cwiseMax(p - max).cwiseMax(0.0).squaredNorm();
}

/// Feature of a triangle: corner 0 … 2, edge 3 + k from corner k to k + 1, or the face.
constexpr int kEdge = 3, kFace = 6;

/// The nearest point of a triangle and its feature (Ericson, Real-Time Collision Detection, 2005, 5.1.5).
Vec3 closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, int& feature) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return feature = 0, a;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return feature = 1, b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return feature = kEdge, a + d1 / (d1 - d3) * ab;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return feature = 2, c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return feature = kEdge + 2, a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4, on_bc = d4 - d3, on_cb = d5 - d6;
  if (va <= 0 && on_bc >= 0 && on_cb >= 0) return feature = kEdge + 1, b + on_bc / (on_bc + on_cb) * (c - b);
  const double scale = 1 / (va + vb + vc);
  return feature = kFace, a + scale * vb * ab + scale * vc * ac;
}

}  // namespace

template <class Visit>
void SurfaceBvh::visit_crossings(const Vec3& a, const Vec3& d, double t_min, double& t_max,
                                 Visit&& visit) const noexcept {
  const SegmentTest segment(a, d);
  struct Entry {
    std::uint32_t node;
    double t;
  };
  std::array<Entry, kMaxDepth> stack;
  std::size_t size = 0;
  Entry next{0, segment.box(nodes_[0].min, nodes_[0].max, t_min, t_max)};
  for (;;) {
    if (next.t <= t_max) {
      const Node& node = nodes_[next.node];
      if (node.count == 0) {
        const Node *left = &nodes_[node.first], *right = left + 1;
        Entry near{node.first, segment.box(left->min, left->max, t_min, t_max)};
        Entry far{node.first + 1, segment.box(right->min, right->max, t_min, t_max)};
        if (far.t < near.t) std::swap(near, far);
        if (far.t <= t_max) stack[size++] = far;
        next = near;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Triangle& c = mesh_.triangles[order_[i]];
        double t;
        bool entering;
        if (!segment.triangle(mesh_.vertices[c[0]], mesh_.vertices[c[1]], mesh_.vertices[c[2]], t, entering))
          continue;
        if (t >= t_min && t <= t_max) visit(t, order_[i], entering);
      }
    }
    if (size == 0) return;
    next = stack[--size];
  }
}

std::optional<SurfaceHit> SurfaceBvh::first_hit(const Vec3& a, const Vec3& b) const noexcept {
  const Vec3 d = b - a;
  const double length = d.norm();
  if (!(length >= kMinLength && length < kInfinity)) return std::nullopt;
  const double slack = kEndSlack / length;
  SurfaceHit hit;
  hit.t = kInfinity;
  double t_max = 1 + slack;
  visit_crossings(a, d, -slack, t_max, [&](double t, std::uint32_t triangle, bool entering) {
    if (t > hit.t || (t == hit.t && triangle > hit.triangle)) return;
    hit.t = t_max = t;
    hit.triangle = triangle;
    hit.entering = entering;
  });
  if (hit.t == kInfinity) return std::nullopt;
  hit.t = std::clamp(hit.t, 0.0, 1.0);
  hit.point = a + hit.t * d;
  hit.normal = face_normals_[hit.triangle];
  return hit;
}

std::size_t SurfaceBvh::all_hits(const Vec3& a, const Vec3& b, std::span<SurfaceHit> out) const noexcept {
  const Vec3 d = b - a;
  const double length = d.norm();
  if (!(length >= kMinLength && length < kInfinity) || out.empty()) return 0;
  const double slack = kEndSlack / length;
  std::size_t found = 0;
  double t_max = 1 + slack;
  visit_crossings(a, d, -slack, t_max, [&](double t, std::uint32_t triangle, bool entering) {
    if (found == out.size()) --found;  // the farthest is dropped: t ≤ t_max, its t
    std::size_t at = found++;
    for (; at > 0 && (t < out[at - 1].t || (t == out[at - 1].t && triangle < out[at - 1].triangle)); --at) {
      out[at] = out[at - 1];
    }
    out[at].t = t;
    out[at].triangle = triangle;
    out[at].entering = entering;
    if (found == out.size()) t_max = out[found - 1].t;
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found; ++i) {
    if (kept > 0 && out[kept - 1].entering != out[i].entering && out[i].t - out[kept - 1].t <= slack) {
      --kept;
      continue;
    }
    out[kept++] = out[i];
  }
  for (SurfaceHit& hit : out.first(kept)) {
    hit.t = std::clamp(hit.t, 0.0, 1.0);
    hit.point = a + hit.t * d;
    hit.normal = face_normals_[hit.triangle];
  }
  return kept;
}

bool SurfaceBvh::inside(const Vec3& p) const noexcept {
  if (!((p.array() >= min().array()) && (p.array() <= max().array())).all()) return false;
  // Along x to the nearer side of the box and beyond.
  const double width = max().x() - min().x();
  const bool right = p.x() > 0.5 * (min().x() + max().x());
  const Vec3 d(right ? max().x() - p.x() + width : min().x() - p.x() - width, 0, 0);
  int leaving = 0;
  double t_max = 1;
  visit_crossings(p, d, 0, t_max,
                  [&](double, std::uint32_t, bool entering) { leaving += entering ? -1 : 1; });
  return leaving > 0;
}

ClosestPoint SurfaceBvh::closest_point(const Vec3& p) const noexcept {
  struct Entry {
    std::uint32_t node;
    double squared_distance;
  };
  std::array<Entry, kMaxDepth> stack;
  std::size_t size = 0;
  double best = kInfinity;
  int best_feature = kFace;
  ClosestPoint closest;
  Entry next{0, 0};
  for (;;) {
    if (next.squared_distance <= best) {
      const Node& node = nodes_[next.node];
      if (node.count == 0) {
        const Node *left = &nodes_[node.first], *right = left + 1;
        Entry near{node.first, squared_distance_to_box(p, left->min, left->max)};
        Entry far{node.first + 1, squared_distance_to_box(p, right->min, right->max)};
        if (far.squared_distance < near.squared_distance) std::swap(near, far);
        if (far.squared_distance <= best) stack[size++] = far;
        next = near;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        const Triangle& c = mesh_.triangles[order_[i]];
        int feature;
        const Vec3 point =
            closest_on_triangle(p, mesh_.vertices[c[0]], mesh_.vertices[c[1]], mesh_.vertices[c[2]], feature);
        const double distance = (point - p).squaredNorm();
        if (!(distance < best || (distance == best && order_[i] < closest.triangle))) continue;
        best = distance;
        best_feature = feature;
        closest.point = point;
        closest.triangle = order_[i];
      }
    }
    if (size == 0) break;
    next = stack[--size];
  }
  if (best == kInfinity) return {p, Vec3::Zero(), std::numeric_limits<double>::quiet_NaN(), 0};

  const std::uint32_t t = closest.triangle;
  Vec3 normal = face_normals_[t];
  if (best_feature < kEdge) {
    normal = vertex_normals_[mesh_.triangles[t][static_cast<std::size_t>(best_feature)]];
  } else if (best_feature < kFace) {
    normal += face_normals_[neighbours_[t][static_cast<std::size_t>(best_feature - kEdge)]];
  }
  closest.normal = normal.squaredNorm() > 1e-24 ? Vec3(normal.normalized()) : face_normals_[t];
  closest.signed_distance =
      std::copysign(std::sqrt(best), (p - closest.point).dot(closest.normal) < 0 ? -1.0 : 1.0);
  return closest;
}

}  // namespace brachy
