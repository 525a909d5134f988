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
constexpr int kCalcifications = 7;
constexpr double kImageMm = 1;     // UltrasoundImager's grid of the plane, which has no use for more
constexpr float kNothingDb = -90;  // beyond an image's voxels

std::array<float, 3> floats(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
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
    calcifications_.push_back(
        {floats(middle_ + at.cwiseProduct(half_)), static_cast<float>(0.35 + 0.5 * share(2))});
  }
}

Anatomy EchoMap::anatomy() const noexcept {
  Anatomy a;
  a.gland = grids_[kGland].view();
  a.urethra = grids_[kUrethra].view();
  a.bladder = grids_[kBladder].view();
  a.has_surroundings = has_surroundings_;
  a.middle = floats(middle_);
  a.half = floats(half_);
  a.transition_zone = {floats(middle_ + Vec3(0, 0.22, 0.18).cwiseProduct(half_)),
                       floats(Vec3(0.62, 0.55, 0.72).cwiseProduct(half_))};
  // Half full, above the base.
  const Vec3 bladder(1.15 * half_.x(), 0.95 * half_.y(), 20);
  a.full_bladder = {floats(middle_ + Vec3(0, 0.15 * half_.y(), half_.z() + bladder.z() + 2)),
                    floats(bladder)};
  // Two rami that meet in front of the apex and diverge downwards, 6 mm thick.
  const Vec3 top(0, half_.y() + 16, -0.5 * half_.z()),
      bottom(1.7 * half_.x(), 0.2 * half_.y(), -1.8 * half_.z());
  a.ramus_top = floats(top);
  a.ramus_way = floats(bottom - top);
  a.ramus_radius = 6;
  a.calcifications = calcifications_;
  a.seed = seed_;
  return a;
}

void EchoMap::at(const EchoPlaces& places, const ScanLoops& loops, EchoTissues& tissues) const noexcept {
  if (!is_uniform() && !image_db_) return loops.tissues(anatomy(), places, tissues);
  for (std::size_t i = 0; i < places.count; ++i) {
    for (std::size_t b = 0; b < kBoundaries; ++b) tissues.distance_mm[b][i] = b == kGland ? -kFar : kFar;
    tissues.outside_db[i] = tissues.texture_db[i] = 0;
    tissues.loss_share[i] = 1;
    if (!image_db_) continue;
    const Vec3 X(places.x[i], places.y[i], places.z[i]);
    tissues.texture_db[i] = image_db_->contains(X) ? image_db_->at(X) : kNothingDb;
  }
}

}  // namespace brachy
