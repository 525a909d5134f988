#include "core/geometry/simplify/simplify.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "core/geometry/surface/surface_volume.h"

namespace brachy {
namespace {

/// Σ w (n · x + d)² over planes, as xᵀA x + 2 b · x + c.
struct PlaneQuadric {
  Mat3 A = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  double c = 0, weight = 0;

  void add_plane(const Vec3& n, double d, double w) {
    A += w * n * n.transpose();
    b += w * d * n;
    c += w * d * d;
    weight += w;
  }
  PlaneQuadric operator+(const PlaneQuadric& o) const {
    return {A + o.A, b + o.b, c + o.c, weight + o.weight};
  }
  double at(const Vec3& x) const { return std::max(0.0, x.dot(A * x) + 2 * b.dot(x) + c); }
};

/// Where two vertices go together, and the mean squared distance there to the planes that they stand for.
struct Target {
  Vec3 to;
  double cost_mm2;
};

/// Small, because the queue moves it often: its target is found again when its turn has come.
struct Contraction {
  double cost;  ///< mean squared distance, mm², and a little for the length
  std::uint32_t a, b;
  std::uint32_t stamp_a, stamp_b;
  bool operator<(const Contraction& o) const {  // the queue's top is the largest
    if (cost != o.cost) return cost > o.cost;
    return a != o.a ? a > o.a : b > o.b;
  }
};

class Simplifier {
 public:
  Simplifier(const SurfaceMesh& mesh, const SimplifyOptions& options);
  SurfaceMesh run();

 private:
  Target target_of(std::uint32_t a, std::uint32_t b) const;
  void propose(std::uint32_t a, std::uint32_t b);
  bool is_allowed(std::uint32_t a, std::uint32_t b, const Vec3& to);
  void contract(std::uint32_t a, std::uint32_t b, const Vec3& to);
  void neighbours(std::uint32_t v, std::vector<std::uint32_t>& out) const;
  bool turns_over(std::uint32_t v, std::uint32_t other, const Vec3& to) const;

  SurfaceMesh mesh_;
  SimplifyOptions options_;
  std::vector<PlaneQuadric> quadrics_;
  std::vector<std::vector<std::uint32_t>> around_;  // triangles of each vertex
  std::vector<std::uint32_t> stamps_;
  std::vector<bool> is_gone_, triangle_is_gone_;
  std::size_t left_;
  std::priority_queue<Contraction> queue_;
  std::vector<std::uint32_t> near_a_, near_b_;
};

Simplifier::Simplifier(const SurfaceMesh& mesh, const SimplifyOptions& options)
    : mesh_(mesh),
      options_(options),
      quadrics_(mesh.vertices.size()),
      around_(mesh.vertices.size()),
      stamps_(mesh.vertices.size(), 0),
      is_gone_(mesh.vertices.size(), false),
      triangle_is_gone_(mesh.triangles.size(), false),
      left_(mesh.vertices.size()) {
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh_.triangles[t];
    const Vec3 n = (mesh_.vertices[b] - mesh_.vertices[a]).cross(mesh_.vertices[c] - mesh_.vertices[a]);
    const double twice = n.norm();
    for (const auto v : {a, b, c}) {
      around_[v].push_back(t);
      if (twice > 0) quadrics_[v].add_plane(n / twice, -n.dot(mesh_.vertices[a]) / twice, twice);
    }
  }
  for (const Triangle& t : mesh_.triangles)
    for (std::size_t n = 0; n < 3; ++n)
      if (t[n] < t[(n + 1) % 3]) propose(t[n], t[(n + 1) % 3]);
}

Target Simplifier::target_of(std::uint32_t a, std::uint32_t b) const {
  const PlaneQuadric q = quadrics_[a] + quadrics_[b];
  const Vec3 middle = 0.5 * (mesh_.vertices[a] + mesh_.vertices[b]);
  // A little pull towards the middle makes the point unique on planes and ridges.
  const double pull = 1e-3 * q.A.trace() + 1e-12;
  const Mat3 A = q.A + pull * Mat3::Identity();
  Vec3 to = A.inverse() * (pull * middle - q.b);
  const double length = (mesh_.vertices[a] - mesh_.vertices[b]).norm();
  if (!to.allFinite() || (to - middle).norm() > 2 * length) to = middle;
  return {to, q.weight > 0 ? q.at(to) / q.weight : 0};
}

void Simplifier::propose(std::uint32_t a, std::uint32_t b) {
  if (a > b) std::swap(a, b);
  const double cost = target_of(a, b).cost_mm2;
  if (cost > options_.tolerance_mm * options_.tolerance_mm) return;
  const double length = (mesh_.vertices[a] - mesh_.vertices[b]).norm();
  // Where it costs nothing, short edges first.
  queue_.push({cost + 1e-9 * length * length, a, b, stamps_[a], stamps_[b]});
}

void Simplifier::neighbours(std::uint32_t v, std::vector<std::uint32_t>& out) const {
  out.clear();
  for (const std::uint32_t t : around_[v])
    for (const std::uint32_t w : mesh_.triangles[t])
      if (w != v) out.push_back(w);
  std::ranges::sort(out);
  out.erase(std::unique(out.begin(), out.end()), out.end());
}

bool Simplifier::turns_over(std::uint32_t v, std::uint32_t other, const Vec3& to) const {
  for (const std::uint32_t t : around_[v]) {
    const Triangle& corners = mesh_.triangles[t];
    if (std::ranges::find(corners, other) != corners.end()) continue;  // it goes
    std::array<Vec3, 3> before, after;
    for (std::size_t n = 0; n < 3; ++n) {
      before[n] = mesh_.vertices[corners[n]];
      after[n] = corners[n] == v ? to : before[n];
    }
    const Vec3 n0 = (before[1] - before[0]).cross(before[2] - before[0]);
    const Vec3 n1 = (after[1] - after[0]).cross(after[2] - after[0]);
    if (n1.dot(n0) < 0.3 * n1.norm() * n0.norm()) return true;
    // No needles: the height over the longest side is at least a twentieth of it.
    const double longest = std::max({(after[1] - after[0]).squaredNorm(), (after[2] - after[1]).squaredNorm(),
                                     (after[0] - after[2]).squaredNorm()});
    if (n1.norm() < 0.05 * longest && n1.norm() * 1.01 < n0.norm()) return true;
  }
  return false;
}

bool Simplifier::is_allowed(std::uint32_t a, std::uint32_t b, const Vec3& to) {
  neighbours(a, near_a_);
  neighbours(b, near_b_);
  std::size_t common = 0;
  for (const std::uint32_t v : near_a_) common += std::ranges::binary_search(near_b_, v) ? 1 : 0;
  if (common != 2 || near_a_.size() + near_b_.size() > 40) return false;
  // A vertex with three neighbours would leave two triangles on the same corners.
  if (near_a_.size() + near_b_.size() - 4 < 3) return false;
  return !turns_over(a, b, to) && !turns_over(b, a, to);
}

void Simplifier::contract(std::uint32_t a, std::uint32_t b, const Vec3& to) {
  mesh_.vertices[a] = to;
  quadrics_[a] = quadrics_[a] + quadrics_[b];
  is_gone_[b] = true;
  --left_;
  for (const std::uint32_t t : around_[b]) {
    Triangle& corners = mesh_.triangles[t];
    if (std::ranges::find(corners, a) != corners.end()) {
      triangle_is_gone_[t] = true;
      for (const std::uint32_t v : corners)
        if (v != b) std::erase(around_[v], t);
      continue;
    }
    std::ranges::replace(corners, b, a);
    around_[a].push_back(t);
  }
  around_[b] = {};
  ++stamps_[a];
  ++stamps_[b];
  neighbours(a, near_a_);
  for (const std::uint32_t v : near_a_) propose(a, v);
}

SurfaceMesh Simplifier::run() {
  while (!queue_.empty() && left_ > options_.least_vertices) {
    const Contraction next = queue_.top();
    queue_.pop();
    if (is_gone_[next.a] || is_gone_[next.b] || stamps_[next.a] != next.stamp_a ||
        stamps_[next.b] != next.stamp_b)
      continue;
    const Vec3 to = target_of(next.a, next.b).to;
    if (is_allowed(next.a, next.b, to)) contract(next.a, next.b, to);
  }
  SurfaceMesh result;
  std::vector<std::uint32_t> index(mesh_.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
    if (is_gone_[v] || around_[v].empty()) continue;
    index[v] = static_cast<std::uint32_t>(result.vertices.size());
    result.vertices.push_back(mesh_.vertices[v]);
  }
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    if (triangle_is_gone_[t]) continue;
    const auto& [a, b, c] = mesh_.triangles[t];
    result.triangles.push_back({index[a], index[b], index[c]});
  }
  return result;
}

}  // namespace

SurfaceMesh simplify(const SurfaceMesh& mesh, const SimplifyOptions& options) {
  SurfaceMesh result = Simplifier(mesh, options).run();
  move_to_volume(result, enclosed_mm3(mesh), options.tolerance_mm);
  return result;
}

}  // namespace brachy
