#include "core/geometry/tissue/phantom.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace brachy {
namespace {

constexpr double kPi = std::numbers::pi;

double square(double x) {
  return x * x;
}

/// 0 for x ≤ 0, rising as x³, so that two derivatives are continuous.
double ramp(double x) {
  return x > 0 ? x * x * x : 0;
}

/// The radius at unit direction n as a share of the ellipsoid's; smooth and positive, so the shape is star-shaped.
double radius_share(const Vec3& n) {
  constexpr double kSharpness = 6;  // of the rounded edges between the bounding surfaces below
  // Each term is 1 / (distance to one bounding surface along n); the largest, softly, decides.
  const double back = std::max(0.0, -n.y()) / 0.80;  // the flat back, towards the rectum
  const double base = std::max(0.0, n.z()) / 0.84;   // the broad base, under the bladder
  const double lateral = std::sqrt(n.x() * n.x() + n.y() * n.y() + 0.01);
  const double cone = std::max(0.0, lateral - 0.62 * n.z()) / 1.02;  // the flanks, tapering to the apex
  const double inverse =
      std::pow(1 + std::pow(back, kSharpness) + std::pow(base, kSharpness) + std::pow(cone, kSharpness),
               1 / kSharpness);
  const double sulcus =
      0.09 * ramp(-n.y()) * std::exp(-square(n.x() / 0.2)) * std::exp(-square((n.z() - 0.1) / 0.6));
  const double neck = 0.08 * ramp(n.z()) * std::exp(-(square(n.x()) + square(n.y() - 0.1)) / square(0.28));
  const double lobes = 0.05 * square(n.x()) * ramp(0.6 - n.y()) * std::exp(-square((n.z() - 0.15) / 0.7));
  return (1 - sulcus - neck + lobes) / inverse;
}

/// x right–left, y front–back, z base–apex; at polar angle θ from the base and azimuth φ from the back (−y).
Vec3 shape_point(double polar, double azimuth) {
  const Vec3 n(std::sin(polar) * std::sin(azimuth), -std::sin(polar) * std::cos(azimuth), std::cos(polar));
  return radius_share(n) * (0.5 * phantom_size()).cwiseProduct(n);
}

/// Cumulative length of a sampled curve, from 0.
template <class Curve>
std::vector<double> arc_lengths(std::size_t steps, double end, Curve&& curve) {
  std::vector<double> lengths = {0};
  Vec3 last = curve(0.0);
  for (std::size_t i = 1; i <= steps; ++i) {
    const Vec3 p = curve(end * static_cast<double>(i) / static_cast<double>(steps));
    lengths.push_back(lengths.back() + (p - last).norm());
    last = p;
  }
  return lengths;
}

/// The parameter in 0 … end at which the cumulative length is `length`.
double at_length(const std::vector<double>& lengths, double length, double end) {
  const auto above = std::upper_bound(lengths.begin() + 1, lengths.end() - 1, length);
  const double before = *(above - 1), share = (length - before) / (*above - before);
  return end * (static_cast<double>(above - lengths.begin() - 1) + share) /
         static_cast<double>(lengths.size() - 1);
}

/// Whole numbers ≥ 3 proportional to the weights with the given sum: the largest remainders round up.
std::vector<std::size_t> apportion(const std::vector<double>& weights, std::size_t sum) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  const double spare = static_cast<double>(sum - 3 * weights.size());
  std::vector<std::size_t> counts, order(weights.size());
  std::vector<double> remainders;
  for (const double w : weights) {
    const double share = spare * w / total;
    counts.push_back(3 + static_cast<std::size_t>(share));
    remainders.push_back(share - std::floor(share));
  }
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return remainders[a] > remainders[b]; });
  std::size_t missing = sum - std::accumulate(counts.begin(), counts.end(), std::size_t{0});
  for (std::size_t i = 0; missing > 0; ++i, --missing) ++counts[order[i % order.size()]];
  return counts;
}

struct Ring {
  std::uint32_t first = 0, count = 0;
  double phase = 0;  ///< of the first vertex, in spacings
  std::uint32_t vertex(std::uint32_t i) const { return first + i % count; }
  double place(std::uint32_t i) const {
    return (i + phase) / std::max(count, 1u);
  }  ///< 0 … 1 around, by length
};

/// Triangles between a ring and the next one below, always along the diagonal that is shorter around.
void zip(const Ring& upper, const Ring& lower, std::vector<Triangle>& triangles) {
  std::uint32_t i = 0, j = 0;
  while (i < upper.count || j < lower.count) {
    const bool on_upper =
        j == lower.count || (i < upper.count && std::abs(upper.place(i + 1) - lower.place(j)) <=
                                                    std::abs(lower.place(j + 1) - upper.place(i)));
    if (on_upper) {
      triangles.push_back({upper.vertex(i), lower.vertex(j), upper.vertex(i + 1)});
      ++i;
    } else {
      triangles.push_back({upper.vertex(i), lower.vertex(j), lower.vertex(j + 1)});
      ++j;
    }
  }
}

/// Stretches the mesh to its exact box, centred at the origin; it stays star-shaped.
void fit_box(std::vector<Vec3>& vertices) {
  Vec3 min = vertices[0], max = vertices[0];
  for (const Vec3& v : vertices) {
    min = min.cwiseMin(v);
    max = max.cwiseMax(v);
  }
  const Vec3 middle = 0.5 * (min + max), scale = phantom_size().cwiseQuotient(max - min);
  for (Vec3& v : vertices) v = scale.cwiseProduct(v - middle);
}

}  // namespace

SurfaceMesh prostate_phantom(std::size_t surface_vertices) {
  if (surface_vertices < 50 || surface_vertices > 1'000'000) {
    throw UserError("the phantom: " + std::to_string(surface_vertices) +
                    " surface vertices are not possible; use 50 … 1000000");
  }
  constexpr std::size_t kSteps = 512, kMeridians = 16;
  std::vector<double> down(kSteps + 1, 0);  // mean length along a meridian
  for (std::size_t m = 0; m < kMeridians; ++m) {
    const double azimuth = 2 * kPi * static_cast<double>(m) / kMeridians;
    const auto lengths = arc_lengths(kSteps, kPi, [&](double polar) { return shape_point(polar, azimuth); });
    for (std::size_t i = 0; i <= kSteps; ++i) down[i] += lengths[i] / kMeridians;
  }
  const auto around = [&](double polar) {
    return arc_lengths(kSteps, 2 * kPi, [&](double azimuth) { return shape_point(polar, azimuth); });
  };
  double area = 0;
  for (std::size_t i = 1; i < kSteps; i += 8) {
    area += around(kPi * static_cast<double>(i) / kSteps).back() * (down[i] - down[i - 1]) * 8;
  }
  // Equilateral triangles: a vertex has the area √3/2 spacing², rings stand √3/2 spacing apart.
  const double spacing = std::sqrt(area / static_cast<double>(surface_vertices) * 2 / std::sqrt(3.0));
  const auto rings_wanted = static_cast<std::size_t>(std::lround(down.back() / (spacing * std::sqrt(0.75))));
  const std::size_t ring_count = std::clamp(rings_wanted, std::size_t{4}, surface_vertices / 4) - 1;

  std::vector<double> polar(ring_count), circumference(ring_count);
  for (std::size_t k = 0; k < ring_count; ++k) {
    const double share = static_cast<double>(k + 1) / static_cast<double>(ring_count + 1);
    polar[k] = at_length(down, share * down.back(), kPi);
    circumference[k] = around(polar[k]).back();
  }
  const std::vector<std::size_t> counts = apportion(circumference, surface_vertices - 2);

  SurfaceMesh mesh;
  mesh.vertices.push_back(shape_point(0, 0));
  Ring above;
  for (std::size_t k = 0; k < ring_count; ++k) {
    const Ring ring{static_cast<std::uint32_t>(mesh.vertices.size()), static_cast<std::uint32_t>(counts[k]),
                    k % 2 == 0 ? 0.0 : 0.5};
    const std::vector<double> lengths = around(polar[k]);
    for (std::uint32_t i = 0; i < ring.count; ++i) {
      mesh.vertices.push_back(
          shape_point(polar[k], at_length(lengths, ring.place(i) * lengths.back(), 2 * kPi)));
    }
    for (std::uint32_t i = 0; k == 0 && i < ring.count; ++i) {
      mesh.triangles.push_back({0, ring.vertex(i), ring.vertex(i + 1)});
    }
    if (k > 0) zip(above, ring, mesh.triangles);
    above = ring;
  }
  const auto apex = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back(shape_point(kPi, 0));
  for (std::uint32_t i = 0; i < above.count; ++i) {
    mesh.triangles.push_back({above.vertex(i), apex, above.vertex(i + 1)});
  }
  fit_box(mesh.vertices);
  return mesh;
}

}  // namespace brachy
