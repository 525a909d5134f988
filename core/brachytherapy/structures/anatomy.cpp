#include "core/brachytherapy/structures/anatomy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "core/geometry/contours/mesh_contours.h"
#include "core/geometry/surface/surface_volume.h"

namespace brachy {
namespace {

struct VolumeBounds {
  StructureRole role;
  double least_cc, most_cc;
};
constexpr std::array kBounds = {VolumeBounds{StructureRole::kGland, 5, 350},
                                VolumeBounds{StructureRole::kUrethra, 0.02, 25},
                                VolumeBounds{StructureRole::kRectum, 1, 700},
                                VolumeBounds{StructureRole::kBladder, 1, 1500},
                                VolumeBounds{StructureRole::kSeminalVesicles, 0.2, 80},
                                VolumeBounds{StructureRole::kPenileBulb, 0.3, 30},
                                VolumeBounds{StructureRole::kFemoralHead, 10, 450}};

constexpr double kSlackMm = 1;  // of a side
constexpr int kLevels = 9;      // planes across the gland

std::string mm_text(double mm) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.*f mm", std::abs(mm) < 9.95 ? 1 : 0, mm);
  return text.data();
}

std::string cc_text(double cc) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.3g cc", cc);
  return text.data();
}

StructurePlace place_of(const Structure& structure) {
  StructurePlace place;
  place.name = structure.shown_name();
  place.role = structure.role;
  place.volume_cc = 1e-3 * enclosed_mm3(structure.mesh);
  place.centroid = enclosed_centroid(structure.mesh);
  if (structure.mesh.vertices.empty()) return place;
  place.min = place.max = structure.mesh.vertices.front();
  for (const Vec3& v : structure.mesh.vertices) {
    place.min = place.min.cwiseMin(v);
    place.max = place.max.cwiseMax(v);
  }
  return place;
}

/// The centroid of a section, and none where the plane misses the structure.
std::optional<Vec3> section_centroid(const SurfaceMesh& mesh, double z) {
  double twice = 0;
  Vec3 sum(0, 0, 0);
  for (const Polygon& polygon : mesh_contours(mesh, z))
    for (std::size_t n = 0; n < polygon.size(); ++n) {
      const auto &a = polygon[n], &b = polygon[(n + 1) % polygon.size()];
      const double cross = a.x() * b.y() - b.x() * a.y();
      twice += cross;
      sum += cross / 3 * Vec3(a.x() + b.x(), a.y() + b.y(), 0);
    }
  if (std::abs(twice) < 1e-9) return std::nullopt;
  return Vec3(sum.x() / twice, sum.y() / twice, z);
}

/// Within one of a section's outlines, also where that is a hole: a label map's gland has one where the urethra is.
bool is_within_outlines(const SurfaceMesh& mesh, const Vec3& p) {
  return std::ranges::any_of(mesh_contours(mesh, p.z()), [&](const Polygon& polygon) {
    bool is_inside = false;
    for (std::size_t n = 0; n < polygon.size(); ++n) {
      const auto &a = polygon[n], &b = polygon[(n + 1) % polygon.size()];
      if ((a.y() > p.y()) == (b.y() > p.y())) continue;
      if (p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) is_inside = !is_inside;
    }
    return is_inside;
  });
}

class Anatomy {
 public:
  Anatomy(const std::vector<Structure>& structures, const VoxelGrid* image)
      : structures_(structures),
        image_(image),
        places_(structure_places(structures)),
        gland_(places_.front()) {}

  std::vector<std::string> warnings() {
    for (std::size_t n = 0; n < structures_.size(); ++n) {
      check_volume(n);
      check_place(n);
      check_side(n);
      if (image_) check_image(n);
    }
    return std::move(warnings_);
  }

 private:
  void warn(std::size_t n, const std::string& what) {
    warnings_.push_back("\"" + places_[n].name + "\" " + what);
  }

  /// Where the structure is beside the gland, if it is there; else all of it.
  Vec3 beside_gland(std::size_t n) const {
    Vec3 sum = Vec3::Zero();
    int count = 0;
    for (int level = 0; level < kLevels; ++level)
      if (const auto at = section_centroid(structures_[n].mesh, level_z(level))) {
        sum += *at;
        ++count;
      }
    return count > 0 ? Vec3(sum / count) : places_[n].centroid;
  }
  double level_z(int level) const {
    return gland_.min.z() + (gland_.max.z() - gland_.min.z()) * (level + 0.5) / kLevels;
  }

  void check_volume(std::size_t n) {
    const auto bounds = std::ranges::find(kBounds, places_[n].role, &VolumeBounds::role);
    const double cc = places_[n].volume_cc;
    if (bounds == kBounds.end()) return;
    if (cc >= bounds->least_cc && cc <= bounds->most_cc) return check_extent(n);
    warn(n, "has " + cc_text(cc) + ", and a " + role_word(places_[n].role) + " has " +
                cc_text(bounds->least_cc) + " to " + cc_text(bounds->most_cc) +
                ": check its units, or that it is that organ");
  }

  /// Of a gland whose volume is one's: a liver's slice has it too.
  void check_extent(std::size_t n) {
    constexpr double kLeastMm = 10, kMostMm = 120;
    const Vec3 extent = places_[n].max - places_[n].min;
    if (n > 0 || (extent.minCoeff() >= kLeastMm && extent.maxCoeff() <= kMostMm)) return;
    warn(n, "extends " + mm_text(extent.minCoeff()) + " to " + mm_text(extent.maxCoeff()) +
                ", and a prostate " + mm_text(kLeastMm) + " to " + mm_text(kMostMm) +
                ": check its units, or that it is that organ");
  }

  void check_place(std::size_t n) {
    using enum StructureRole;
    const Vec3 off = places_[n].centroid - gland_.centroid;
    switch (places_[n].role) {
      case kRectum:
        if (const double y = beside_gland(n).y() - gland_.centroid.y(); y > -kSlackMm)
          warn(n, "is not posterior of the prostate (" + mm_text(y) +
                      " anterior of its middle): check the frame (LPS or RAS)");
        break;
      case kPubicArch:
        if (off.y() < kSlackMm)
          warn(n, "is not anterior of the prostate (" + mm_text(-off.y()) +
                      " posterior): check the frame (LPS or RAS)");
        break;
      case kBladder:
      case kSeminalVesicles:
        if (off.z() < kSlackMm)
          warn(n, "is not superior of the prostate (" + mm_text(-off.z()) +
                      " inferior): check the direction of the slices");
        break;
      case kPenileBulb:
        if (off.z() > -kSlackMm)
          warn(n, "is not inferior of the prostate (" + mm_text(off.z()) +
                      " superior): check the direction of the slices");
        break;
      case kUrethra:
        check_urethra(n);
        break;
      default:
        break;
    }
  }

  void check_urethra(std::size_t n) {
    int seen = 0, inside = 0;
    for (int level = 0; level < kLevels; ++level)
      if (const auto at = section_centroid(structures_[n].mesh, level_z(level))) {
        ++seen;
        inside += is_within_outlines(structures_.front().mesh, *at) ? 1 : 0;
      }
    if (seen == 0)
      warn(n, "does not pass through the prostate: it lies " + places_[n].side);
    else if (2 * inside < seen)
      warn(n, "lies outside the prostate in " + std::to_string(seen - inside) + " of " +
                  std::to_string(seen) + " planes across it");
  }

  void check_side(std::size_t n) {
    const BodySide side = side_of_name(places_[n].name);
    if (side == BodySide::kNone || places_[n].role == StructureRole::kTarget || n == 0) return;
    const double right = places_[n].centroid.x() - gland_.centroid.x();  // +x is the patient's right
    if (side == BodySide::kLeft ? right <= kSlackMm : right >= -kSlackMm) return;
    warn(n, std::string("lies on the patient's ") + (right > 0 ? "right" : "left") + ", " +
                mm_text(std::abs(right)) + " from the prostate's middle, and its name says " +
                (side == BodySide::kLeft ? "left" : "right") + ": check the frame (LPS or RAS), or the name");
  }

  void check_image(std::size_t n) {
    const Mat3 to_index = image_->steps.inverse();
    double most_mm = 0;
    std::size_t outside = 0;
    for (const Vec3& v : structures_[n].mesh.vertices) {
      const Vec3 at = to_index * (v - image_->origin);
      bool is_out = false;
      for (int a = 0; a < 3; ++a) {
        const auto last = static_cast<double>(image_->size[static_cast<std::size_t>(a)]) - 1;
        const double steps = std::max(-at[a], at[a] - last) - 1.5;  // half a voxel, and one of slack
        if (steps <= 0) continue;
        is_out = true;
        most_mm = std::max(most_mm, (steps + 1) * image_->steps.col(a).norm());
      }
      outside += is_out ? 1 : 0;
    }
    if (outside == 0) return;
    warn(n, (outside == structures_[n].mesh.vertices.size() ? "lies outside the image, up to "
                                                            : "reaches out of the image by up to ") +
                mm_text(most_mm) + ": check that both are of one study");
  }

  const std::vector<Structure>& structures_;
  const VoxelGrid* image_;
  std::vector<StructurePlace> places_;
  const StructurePlace& gland_;
  std::vector<std::string> warnings_;
};

}  // namespace

std::vector<StructurePlace> structure_places(const std::vector<Structure>& structures) {
  std::vector<StructurePlace> places;
  for (const Structure& structure : structures) {
    StructurePlace place = place_of(structure);
    if (!places.empty()) {
      constexpr std::array<std::array<const char*, 2>, 3> kSides = {
          {{"left", "right"}, {"posterior", "anterior"}, {"inferior", "superior"}}};
      const Vec3 off = place.centroid - places.front().centroid;
      Eigen::Index a = 0;
      const double most = off.cwiseAbs().maxCoeff(&a);
      place.side = most < 0.5 ? "in the prostate's middle"
                              : std::string(kSides[static_cast<std::size_t>(a)][off[a] > 0 ? 1 : 0]) +
                                    " of the prostate by " + mm_text(most);
    }
    places.push_back(std::move(place));
  }
  return places;
}

std::vector<std::string> anatomy_warnings(const std::vector<Structure>& structures, const VoxelGrid* image) {
  if (structures.empty()) return {};
  return Anatomy(structures, image).warnings();
}

std::string implant_warning(const std::vector<Structure>& structures, const std::vector<Vec3>& seeds) {
  constexpr double kOutsideMm = 10;
  if (structures.empty() || seeds.empty()) return {};
  const StructurePlace gland = place_of(structures.front());
  std::size_t outside = 0;
  Vec3 middle = Vec3::Zero();
  for (const Vec3& seed : seeds) {
    middle += seed / static_cast<double>(seeds.size());
    outside += (gland.min - seed).cwiseMax(seed - gland.max).maxCoeff() > kOutsideMm ? 1 : 0;
  }
  if (2 * outside <= seeds.size()) return {};
  return std::to_string(outside) + " of " + std::to_string(seeds.size()) + " seeds lie " +
         mm_text(kOutsideMm) + " or more outside the prostate, their middle " +
         mm_text((middle - gland.centroid).norm()) +
         " from its middle: check their frame (LPS or RAS), their unit, and that they are of this patient "
         "and day";
}

}  // namespace brachy
