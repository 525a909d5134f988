#include "core/ultrasound/echo_map.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/geometry/label_map/rasterise.h"
#include "core/ultrasound/hashed_noise.h"

namespace brachy {
namespace {

constexpr double kFineMm = 1, kCoarseMm = 1.5, kMarginMm = 8;
constexpr float kFar = 1e3F;
constexpr float kUsed = 2.5F;  // mm: how far beyond a boundary its sides are interpolated
constexpr double kMuscleLevel = -4, kFasciaLevel = 7;  // dB
constexpr int kCalcifications = 7;
constexpr double kCalcificationDb = 20;
constexpr std::uint32_t kFirstGrainSeed = 11;
constexpr double kImageMm = 1;     // UltrasoundImager's grid of the plane, which has no use for more
constexpr float kNothingDb = -90;  // beyond an image's voxels

struct GrainSize {
  std::array<float, 3> cell_mm;
  float lean = 0;  // y rises with |x|
};
enum Grain : std::size_t { kDucts, kStroma, kZoneEdge, kZone, kFascia, kPatches, kVeins };
constexpr std::array<GrainSize, 7> kGrainSizes = {{{{4.5F, 3.5F, 4.5F}},
                                                   {{1.8F, 1.6F, 1.8F}},
                                                   {{6, 5, 7}},
                                                   {{6.5F, 5, 6.5F}},
                                                   {{14, 1.3F, 16}, 0.12F},
                                                   {{5, 3, 6}},
                                                   {{5, 3.2F, 7}}}};

// Of an ellipsoid: exact to first order about its surface (I. Quilez, Ellipsoid distance estimation).
float ellipsoid_distance(const Vec3& X, const Vec3& centre, const Vec3& semi_axes) {
  const Vec3 p = (X - centre).cwiseQuotient(semi_axes);
  const double k0 = p.norm(), k1 = p.cwiseQuotient(semi_axes).norm();
  return static_cast<float>(k1 > 0 ? k0 * (k0 - 1) / k1 : -semi_axes.minCoeff());
}

const Structure& gland_of(const std::vector<Structure>& structures) {
  const Structure* gland = find_structure(structures, "prostate");
  if (!gland) throw UserError("an ultrasound image needs a structure \"prostate\"; the scene has none");
  return *gland;
}

std::string place(const Vec3& p) {
  return "(" + text_of(p.x()) + ", " + text_of(p.y()) + ", " + text_of(p.z()) + ") mm";
}

Vec3 middle_of(const VoxelGrid& grid) {
  Vec3 last;
  for (Eigen::Index a = 0; a < 3; ++a)
    last[a] = static_cast<double>(grid.size[static_cast<std::size_t>(a)] - 1);
  return grid.position(0.5 * last);
}

double mean_within(const SurfaceBvh& surface, const Volume& image) {
  std::vector<std::uint16_t> labels(image.grid().count(), 0);
  const std::size_t count = rasterise(surface, image.grid(), 1, labels);
  if (count == 0)
    throw UserError("the ultrasound volume has no voxel in the prostate: its middle is at " +
                    place(middle_of(image.grid())) + ", the prostate's at " +
                    place(0.5 * (surface.min() + surface.max())) +
                    "; give it the space and origin of the scene's structures");
  double sum = 0;
  for (std::size_t i = 0; i < labels.size(); ++i) sum += labels[i] * double{image.values()[i]};
  return sum / static_cast<double>(count);
}

}  // namespace

EchoMap::EchoMap(const std::vector<Structure>& structures, const Volume& image, double db_per_value) {
  const Volume coarse = image.coarsened(kImageMm);
  const double mean = mean_within(SurfaceBvh(gland_of(structures).mesh), coarse);
  std::vector<float> levels;
  levels.reserve(coarse.values().size());
  for (const float value : coarse.values())
    levels.push_back(static_cast<float>(db_per_value * (double{value} - mean)));
  image_db_.emplace(coarse.grid(), std::move(levels));
}

EchoMap::EchoMap(const std::vector<Structure>& structures, bool has_surroundings, std::uint64_t seed)
    : has_surroundings_(has_surroundings),
      seed_(hashed(static_cast<std::uint32_t>(seed) ^ hashed(static_cast<std::uint32_t>(seed >> 32)))) {
  const SurfaceBvh surface(gland_of(structures).mesh);
  grids_[kGland] = DistanceGrid(surface, kCoarseMm, kMarginMm);
  middle_ = 0.5 * (surface.min() + surface.max());
  half_ = 0.5 * (surface.max() - surface.min());
  if (const Structure* urethra = find_structure(structures, "urethra"))
    grids_[kUrethra] = DistanceGrid(SurfaceBvh(urethra->mesh), kFineMm, kMarginMm);
  if (const Structure* bladder = find_structure(structures, "bladder"))
    grids_[kBladder] = DistanceGrid(SurfaceBvh(bladder->mesh), kCoarseMm, kMarginMm);
  if (!has_surroundings_) return;
  // Between transition and peripheral zone, where they are usual.
  for (std::uint32_t i = 0; i < kCalcifications; ++i) {
    const auto share = [&](std::uint32_t k) { return hashed(seed_ + 16 * i + k) / 4294967296.0; };
    const double angle = (1.15 + 0.7 * share(0)) * 3.14159265;
    const Vec3 at(0.42 * std::cos(angle), -0.12 + 0.32 * std::sin(angle), 0.7 * share(1) - 0.4);
    calcifications_.push_back({middle_ + at.cwiseProduct(half_), static_cast<float>(0.35 + 0.5 * share(2))});
  }
}

// Half full, above the base.
float EchoMap::bladder_distance(const Vec3& X) const noexcept {
  if (!grids_[kBladder].is_empty()) return grids_[kBladder].at(X);
  const Vec3 semi_axes(1.15 * half_.x(), 0.95 * half_.y(), 20);
  return ellipsoid_distance(X, middle_ + Vec3(0, 0.15 * half_.y(), half_.z() + semi_axes.z() + 2), semi_axes);
}

// Two rami that meet in front of the apex and diverge downwards, 6 mm thick.
float EchoMap::bone_distance(const Vec3& X) const noexcept {
  const Vec3 p = X - middle_;
  const Vec3 top(0, half_.y() + 16, -0.5 * half_.z()),
      bottom(1.7 * half_.x(), 0.2 * half_.y(), -1.8 * half_.z());
  const Vec3 q(std::abs(p.x()), p.y(), p.z()), way = bottom - top;
  const double t = std::clamp((q - top).dot(way) / way.squaredNorm(), 0.0, 1.0);
  return static_cast<float>((q - top - t * way).norm() - 6);
}

float EchoMap::Tissue::loss_share() const noexcept {
  float share = 1;
  for (std::size_t b = 0; b < kBoundaries; ++b)
    share += std::clamp(0.5F - distance_mm[b], 0.0F, 1.0F) * (kInside[b].attenuation_share - share);
  return share;
}

EchoMap::Tissue EchoMap::at(const Vec3& X) const noexcept {
  Tissue tissue;
  at({&X, 1}, scan_loops(best_simd_target()), {&tissue, 1});
  return tissue;
}

void EchoMap::at(std::span<const Vec3> X, const ScanLoops& loops, std::span<Tissue> tissue) const noexcept {
  if (is_uniform() || image_db_) {
    for (std::size_t i = 0; i < X.size(); ++i) tissue[i] = at(X[i], Grains{});
    return;
  }
  constexpr std::size_t kTogether = 64;
  for (std::size_t first = 0; first < X.size(); first += kTogether) {
    const std::size_t count = std::min(kTogether, X.size() - first);
    float x[kTogether], y[kTogether], z[kTogether], leaning_y[kTogether], noise[kTogether];
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = static_cast<float>(X[first + i].x());
      y[i] = static_cast<float>(X[first + i].y());
      z[i] = static_cast<float>(X[first + i].z());
    }
    Grains grains[kTogether];
    for (std::size_t g = 0; g < kGrains; ++g) {
      const GrainSize& size = kGrainSizes[g];
      for (std::size_t i = 0; i < count; ++i) leaning_y[i] = y[i] + size.lean * std::abs(x[i]);
      loops.noise(x, leaning_y, z, count, size.cell_mm.data(),
                  seed_ + kFirstGrainSeed + static_cast<std::uint32_t>(g), noise);
      for (std::size_t i = 0; i < count; ++i) grains[i][g] = noise[i];
    }
    for (std::size_t i = 0; i < count; ++i) tissue[first + i] = at(X[first + i], grains[i]);
  }
}

EchoMap::Tissue EchoMap::at(const Vec3& X, const Grains& grain) const noexcept {
  Tissue tissue;
  tissue.distance_mm.fill(kFar);
  if (is_uniform() || image_db_) {
    tissue.distance_mm[kGland] = -kFar;
    if (image_db_) tissue.texture_db = image_db_->contains(X) ? image_db_->at(X) : kNothingDb;
    return tissue;
  }
  tissue.distance_mm[kGland] = grids_[kGland].at(X);
  tissue.distance_mm[kUrethra] = grids_[kUrethra].at(X);
  const bool may_be_gland =
      tissue.distance_mm[kGland]<kUsed, may_be_outside = tissue.distance_mm[kGland]> - kUsed;
  // Grains of some millimetres: ducts and stroma.
  if (may_be_gland) tissue.texture_db = 1.6F * grain[kDucts] + 1.2F * grain[kStroma];
  if (!has_surroundings_) return tissue;

  const Vec3 p = (X - middle_).cwiseQuotient(half_);
  if (may_be_gland) {
    const Vec3 zone(0.62 * half_.x(), 0.55 * half_.y(), 0.72 * half_.z());
    tissue.distance_mm[kTransition] =
        ellipsoid_distance(X, middle_ + Vec3(0, 0.22, 0.18).cwiseProduct(half_), zone) +
        1.5F * grain[kZoneEdge];
    if (tissue.distance_mm[kTransition] < 0) tissue.texture_db += 2.6F * grain[kZone];
  }
  tissue.distance_mm[kBladder] = bladder_distance(X);
  tissue.distance_mm[kBone] = bone_distance(X);
  for (const Calcification& c : calcifications_) {
    const double d2 = (X - c.at).squaredNorm() / (c.radius * c.radius);
    if (d2 < 9) tissue.texture_db += static_cast<float>(kCalcificationDb * std::exp(-d2));
  }

  if (!may_be_outside) return tissue;
  // Around the gland: fat, with fascia in layers that follow it; farther off and beside it muscle.
  const double out = tissue.distance_mm[kGland];
  const double layers = grain[kFascia], patches = grain[kPatches];
  double level = 5 + kFasciaLevel * std::max(0.0, layers - 0.15) * 1.6 + 3.5 * patches;
  const double muscle = std::clamp((std::abs(p.x()) - 1.12 + 0.1 * patches) * 8, 0.0, 1.0) *
                        std::clamp((1.1 - p.y()) * 4, 0.0, 1.0);
  level += muscle * (kMuscleLevel - level + 4 * layers);
  // Veins in front of the gland.
  const double veins = grain[kVeins];
  if (p.y() > 0.6 && out > 0.5 && out < 7 && veins > 0.25) level -= 22 * std::min(1.0, (veins - 0.25) * 6);
  tissue.outside_db = static_cast<float>(level);
  return tissue;
}

}  // namespace brachy
