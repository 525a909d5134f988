#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/simd/simd_attributes.h"
#include "core/ultrasound/echo_map.h"
#include "core/ultrasound/hashed_noise.h"
#include "core/ultrasound/scatter_loop.h"

// What is at the nodes of the plane's grid; for scan_loops.cpp, which compiles it for each instruction set. All loops
// go over all kMost places, of which those from `count` on repeat the last: loops of a fixed length become vectors.
namespace brachy::scan {

constexpr std::size_t kPlaces = EchoPlaces::kMost;
constexpr float kUsedMm = 2.5F;  // how far beyond the capsule its sides are interpolated
constexpr float kMuscleDb = -4, kFasciaDb = 7, kVeinDb = -22, kCalcificationDb = 20, kTransitionDb = 2.6F;
constexpr std::uint32_t kFirstGrainSeed = 11;

struct PerPlace {
  alignas(64) float v[kPlaces];
};

// Smooth noises that textures are made of: the size of their cells, and how much y rises with |x|.
struct Grain {
  std::uint32_t seed;
  float cell_mm[3];
  float lean = 0;
};
constexpr Grain kDucts = {0, {4.5F, 3.5F, 4.5F}}, kStroma = {1, {1.8F, 1.6F, 1.8F}},
                kZoneEdge = {2, {6, 5, 7}}, kZone = {3, {6.5F, 5, 6.5F}},
                kFascia = {4, {14, 1.3F, 16}, 0.12F}, kPatches = {5, {5, 3, 6}}, kVeins = {6, {5, 3.2F, 7}};

BRACHY_INLINE float smooth_step(float t) {
  return t * t * (3 - 2 * t);
}

BRACHY_INLINE float node_value(std::uint32_t key) {
  return static_cast<float>(static_cast<std::int32_t>(hashed(key) ^ 0x80000000U)) * (1.0F / 2147483648.0F);
}

BRACHY_INLINE float between(float a, float b, float t) {
  return a + t * (b - a);
}

BRACHY_INLINE float within(float x, float least, float most) {
  return std::max(least, std::min(most, x));
}

// −1 … 1, trilinear by smooth steps between random values of the nodes of a grid.
BRACHY_INLINE void smooth_noise(const EchoPlaces& at, const Grain& grain, std::uint32_t map_seed,
                                PerPlace& out) {
  const std::uint32_t seed = map_seed + kFirstGrainSeed + grain.seed;
  const std::uint32_t origin = seed - static_cast<std::uint32_t>(kOffGrid) * (kNodeX + kNodeY + kNodeZ);
  const float per_x = 1 / grain.cell_mm[0], per_y = 1 / grain.cell_mm[1], per_z = 1 / grain.cell_mm[2];
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const float p = at.x[i] * per_x + kOffGrid, r = at.z[i] * per_z + kOffGrid;
    const float q = (at.y[i] + grain.lean * std::abs(at.x[i])) * per_y + kOffGrid;
    const auto ix = static_cast<std::int32_t>(p), iy = static_cast<std::int32_t>(q),
               iz = static_cast<std::int32_t>(r);
    const float s = smooth_step(p - static_cast<float>(ix)), t = smooth_step(q - static_cast<float>(iy)),
                u = smooth_step(r - static_cast<float>(iz));
    const std::uint32_t key = static_cast<std::uint32_t>(ix) * kNodeX +
                              static_cast<std::uint32_t>(iy) * kNodeY +
                              static_cast<std::uint32_t>(iz) * kNodeZ + origin;
    const auto along_x = [&](std::uint32_t k) { return between(node_value(k), node_value(k + kNodeX), s); };
    const auto along_y = [&](std::uint32_t k) { return between(along_x(k), along_x(k + kNodeY), t); };
    out.v[i] = between(along_y(key), along_y(key + kNodeZ), u);
  }
}

BRACHY_INLINE void read_grid(const EchoPlaces& at, const GridView& grid, float* __restrict out) {
  if (!grid.values) {
    std::fill_n(out, kPlaces, grid.outside);
    return;
  }
  const std::int32_t row = grid.counts[0], slice = grid.counts[0] * grid.counts[1];
  const std::int32_t last_x = grid.counts[0] - 2, last_y = grid.counts[1] - 2, last_z = grid.counts[2] - 2;
  const float* __restrict values = grid.values;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const float x = (at.x[i] - grid.least[0]) * grid.per_mm, y = (at.y[i] - grid.least[1]) * grid.per_mm,
                z = (at.z[i] - grid.least[2]) * grid.per_mm;
    const float cx = within(x, 0, static_cast<float>(last_x + 1)),
                cy = within(y, 0, static_cast<float>(last_y + 1)),
                cz = within(z, 0, static_cast<float>(last_z + 1));
    const std::int32_t ix = std::min(static_cast<std::int32_t>(cx), last_x),
                       iy = std::min(static_cast<std::int32_t>(cy), last_y),
                       iz = std::min(static_cast<std::int32_t>(cz), last_z);
    const float s = cx - static_cast<float>(ix), t = cy - static_cast<float>(iy),
                u = cz - static_cast<float>(iz);
    const std::int32_t first = ix + row * iy + slice * iz;
    const auto along = [&](std::int32_t k) { return between(values[k], values[k + 1], s); };
    const auto across = [&](std::int32_t k) { return between(along(k), along(k + row), t); };
    const float value = between(across(first), across(first + slice), u);
    const float off = std::abs(x - cx) + std::abs(y - cy) + std::abs(z - cz);
    out[i] = off > 0 ? grid.outside : value;
  }
}

// Exact to first order about the surface (I. Quilez, Ellipsoid distance estimation).
BRACHY_INLINE void ellipsoid_distances(const EchoPlaces& at, const Anatomy::Ellipsoid& e,
                                       float* __restrict out) {
  constexpr float kAtCentre = 1e-10F;  // instead of 0/0
  const float a = 1 / e.semi_axes[0], b = 1 / e.semi_axes[1], c = 1 / e.semi_axes[2];
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const float x = (at.x[i] - e.centre[0]) * a, y = (at.y[i] - e.centre[1]) * b,
                z = (at.z[i] - e.centre[2]) * c;
    const float xx = x * x + kAtCentre, yy = y * y, zz = z * z;
    const float k0 = std::sqrt(xx + yy + zz), k1 = std::sqrt(xx * (a * a) + yy * (b * b) + zz * (c * c));
    out[i] = k0 * (k0 - 1) / k1;
  }
}

BRACHY_INLINE void bone_distances(const EchoPlaces& at, const Anatomy& body, float* __restrict out) {
  const auto& top = body.ramus_top;
  const auto& way = body.ramus_way;
  const float per_square = 1 / (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const float x = std::abs(at.x[i] - body.middle[0]) - top[0], y = at.y[i] - body.middle[1] - top[1],
                z = at.z[i] - body.middle[2] - top[2];
    const float t = within((x * way[0] + y * way[1] + z * way[2]) * per_square, 0, 1);
    const float dx = x - t * way[0], dy = y - t * way[1], dz = z - t * way[2];
    out[i] = std::sqrt(dx * dx + dy * dy + dz * dz) - body.ramus_radius;
  }
}

BRACHY_INLINE void add_calcifications(const EchoPlaces& at, const Anatomy& body, float* __restrict db) {
  constexpr float kLog2OfE = 1.44269504F, kReach = 9;  // radii², beyond which nothing is left
  for (const Anatomy::Spot& spot : body.calcifications) {
    const float per_square = 1 / (spot.radius * spot.radius);
    PerPlace squares;
    float nearest = kReach;
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const float x = at.x[i] - spot.centre[0], y = at.y[i] - spot.centre[1], z = at.z[i] - spot.centre[2];
      squares.v[i] = (x * x + y * y + z * z) * per_square;
      nearest = std::min(nearest, squares.v[i]);
    }
    if (!(nearest < kReach)) continue;
    for (std::size_t i = 0; i < kPlaces; ++i) {
      const float value = kCalcificationDb * power_of_two(-kLog2OfE * squares.v[i]);
      db[i] += squares.v[i] < kReach ? value : 0;
    }
  }
}

// Grains of some millimetres: ducts and stroma, coarser in the transition zone.
BRACHY_INLINE void find_gland(const EchoPlaces& at, const Anatomy& body, EchoTissues& out) {
  PerPlace ducts, stroma;
  smooth_noise(at, kDucts, body.seed, ducts);
  smooth_noise(at, kStroma, body.seed, stroma);
  for (std::size_t i = 0; i < kPlaces; ++i) out.texture_db[i] = 1.6F * ducts.v[i] + 1.2F * stroma.v[i];
  if (!body.has_surroundings) return;
  PerPlace edge, zone;
  smooth_noise(at, kZoneEdge, body.seed, edge);
  smooth_noise(at, kZone, body.seed, zone);
  float* __restrict distance = out.distance_mm[EchoMap::kTransition];
  ellipsoid_distances(at, body.transition_zone, distance);
  for (std::size_t i = 0; i < kPlaces; ++i) {
    distance[i] += 1.5F * edge.v[i];
    out.texture_db[i] += distance[i] < 0 ? kTransitionDb * zone.v[i] : 0;
  }
  add_calcifications(at, body, out.texture_db);
}

// Around the gland: fat, with fascia in layers that follow it; farther off and beside it muscle; veins in front.
BRACHY_INLINE void find_surroundings(const EchoPlaces& at, const Anatomy& body, EchoTissues& out) {
  PerPlace fascia, patches, veins;
  smooth_noise(at, kFascia, body.seed, fascia);
  smooth_noise(at, kPatches, body.seed, patches);
  smooth_noise(at, kVeins, body.seed, veins);
  const float per_x = 1 / body.half[0], per_y = 1 / body.half[1];
  const float* gland = out.distance_mm[EchoMap::kGland];
  for (std::size_t i = 0; i < kPlaces; ++i) {
    const float x = std::abs(at.x[i] - body.middle[0]) * per_x, y = (at.y[i] - body.middle[1]) * per_y;
    float level = 5 + kFasciaDb * 1.6F * std::max(0.0F, fascia.v[i] - 0.15F) + 3.5F * patches.v[i];
    const float muscle = within((x - 1.12F + 0.1F * patches.v[i]) * 8, 0, 1) * within((1.1F - y) * 4, 0, 1);
    level += muscle * (kMuscleDb - level + 4 * fascia.v[i]);
    const float vein = std::min(1.0F, std::max(0.0F, veins.v[i] - 0.25F) * 6);
    const bool has_veins = (y > 0.6F) & (gland[i] > 0.5F) & (gland[i] < 7);
    level += has_veins ? kVeinDb * vein : 0;
    out.outside_db[i] = level;
  }
}

BRACHY_INLINE void find_losses(EchoTissues& out) {
  std::fill_n(out.loss_share, kPlaces, 1.0F);
  for (std::size_t b = 0; b < EchoMap::kBoundaries; ++b)
    for (std::size_t i = 0; i < kPlaces; ++i)
      out.loss_share[i] += within(0.5F - out.distance_mm[b][i], 0, 1) *
                           (EchoMap::kInside[b].attenuation_share - out.loss_share[i]);
}

BRACHY_INLINE void find_tissues(const Anatomy& body, const EchoPlaces& places, EchoTissues& out) {
  constexpr float kFar = 1e3F;
  EchoPlaces at = places;
  for (std::size_t i = at.count; i < kPlaces; ++i) {
    at.x[i] = at.x[at.count - 1];
    at.y[i] = at.y[at.count - 1];
    at.z[i] = at.z[at.count - 1];
  }
  read_grid(at, body.gland, out.distance_mm[EchoMap::kGland]);
  read_grid(at, body.urethra, out.distance_mm[EchoMap::kUrethra]);
  float least = kFar, most = -kFar;
  for (std::size_t i = 0; i < kPlaces; ++i) {
    least = std::min(least, out.distance_mm[EchoMap::kGland][i]);
    most = std::max(most, out.distance_mm[EchoMap::kGland][i]);
  }
  for (const std::size_t b : {EchoMap::kTransition, EchoMap::kBladder, EchoMap::kBone})
    std::fill_n(out.distance_mm[b], kPlaces, kFar);
  std::fill_n(out.texture_db, kPlaces, 0.0F);
  std::fill_n(out.outside_db, kPlaces, 0.0F);
  if (least < kUsedMm) find_gland(at, body, out);
  if (body.has_surroundings) {
    if (body.bladder.values)
      read_grid(at, body.bladder, out.distance_mm[EchoMap::kBladder]);
    else
      ellipsoid_distances(at, body.full_bladder, out.distance_mm[EchoMap::kBladder]);
    bone_distances(at, body, out.distance_mm[EchoMap::kBone]);
    if (most > -kUsedMm) find_surroundings(at, body, out);
  }
  find_losses(out);
}

}  // namespace brachy::scan
