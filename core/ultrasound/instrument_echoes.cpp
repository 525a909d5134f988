#include "core/ultrasound/instrument_echoes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/plan/plan.h"
#include "core/simulation/delivered_catheters.h"

namespace brachy {
namespace {

constexpr double kPieceMm = 0.25;     // of a cylinder
constexpr double kFarOff = 2.6;       // deviations of the slice beyond which nothing is seen
constexpr double kShadowReach = 2.5;  // deviations of the beam
constexpr double kOffChordMm = 0.05;  // of a needle's course between two stations, which then has four chords
constexpr int kChords = 4;
constexpr double kTipDb = 5;          // more than the shaft's
constexpr double kRoundSide = 0.45;   // rad: where else around the cylinder it is looked at …
constexpr double kRoundShare = 0.35;  // … and how much returns from there
constexpr std::size_t kSidesSeen = 3;
constexpr int kNeedleRepeats = 6, kSeedRepeats = 2;
constexpr int kMostSpacers = 4;          // between two seeds
constexpr double kSpacersOffMm = 1.5;    // how much the gap may differ from their length
constexpr double kSpacersInLine = 0.95;  // cosine
constexpr std::size_t kMostPiecesOfNeedle = 900, kMostPiecesOfSeed = 20 + 96;  // with the spacers behind it

}  // namespace

InstrumentEchoes::InstrumentEchoes(const UltrasoundSettings& settings, const ImagePlane& plane,
                                   double needle_length_mm, double needle_radius_mm, std::size_t max_needles,
                                   std::size_t max_seeds)
    : plane_(plane),
      shadow_db_(settings.shadow_db),
      length_(needle_length_mm),
      radius_(needle_radius_mm),
      needle_db_(settings.needle_echo_db),
      seed_db_(settings.seed_echo_db),
      spacer_db_(settings.spacer_echo_db) {
  const std::size_t pieces = kMostPiecesOfNeedle * max_needles + kMostPiecesOfSeed * max_seeds;
  shadows_.resize(pieces);
  echoes_.resize(pieces * kSidesSeen * (1 + kSeedRepeats));
}

void InstrumentEchoes::find(const RigidTransform& X_WI, std::span<const NeedleState> needles,
                            std::span<const Seed> seeds, const PointSpread& spread) noexcept {
  echo_count_ = shadow_count_ = 0;
  const RigidTransform X_IW = X_WI.inverse();
  const Look needle_look{needle_db_, radius_, 12, 0.04, 0.5, kNeedleRepeats};
  for (const NeedleState& needle : needles) {
    if (!needle.present) continue;
    const NeedleShape& shape = needle.shape;
    Vec3 tip = needle.X_WN.p;
    if (shape.is_bent) {
      add_course(X_IW, needle, needle_look, spread);
      tip = shape.points.back();
    } else {
      add_piece(X_IW, tip - length_ * needle.X_WN.R.col(2), tip, needle_look, spread);
    }
    const Vec3 p_I = X_IW * tip;
    const double e = p_I.z() / spread.elevation_sigma_mm();
    if (std::abs(e) > kFarOff) continue;
    Look flash = needle_look;
    flash.repeats = 2;
    add_point(p_I, std::pow(10, 0.05 * (needle_db_ + kTipDb)) * std::exp(-0.5 * e * e), flash);
  }
  const Look seed_look{seed_db_, 0.5 * kSeedDiameterMm, 5, 0.1, 0.3, kSeedRepeats};
  for (const Seed& seed : seeds) {
    const Vec3 half = 0.5 * kSeedLengthMm * seed.axis;
    add_piece(X_IW, seed.position - half, seed.position + half, seed_look, spread);
  }
  for (std::size_t k = 0; k + 1 < seeds.size(); ++k) add_spacers(X_IW, seeds[k], seeds[k + 1], spread);
}

// Between its stations a needle lies along the spline of point_behind_tip.
void InstrumentEchoes::add_course(const RigidTransform& X_IW, const NeedleState& needle, const Look& look,
                                  const PointSpread& spread) noexcept {
  constexpr std::size_t kPieces = NeedleShape::kPoints - 1;
  const double each = length_ / static_cast<double>(kPieces);
  for (std::size_t k = 0; k < kPieces; ++k) {
    const Vec3 &a = needle.shape.points[k], &b = needle.shape.points[k + 1];
    const double behind = each * static_cast<double>(kPieces - k);  // of a
    const Vec3 middle = point_behind_tip(needle, length_, behind - 0.5 * each);
    if ((middle - 0.5 * (a + b)).norm() <= kOffChordMm) {
      add_piece(X_IW, a, b, look, spread);
      continue;
    }
    Vec3 from = a;
    for (int i = 1; i <= kChords; ++i) {
      const Vec3 to = i == kChords ? b : point_behind_tip(needle, length_, behind - each * i / kChords);
      add_piece(X_IW, from, to, look, spread);
      from = to;
    }
  }
}

void InstrumentEchoes::add_spacers(const RigidTransform& X_IW, const Seed& a, const Seed& b,
                                   const PointSpread& spread) noexcept {
  const Vec3 way = b.position - a.position;
  const double apart = way.norm(), gap = apart - kSeedLengthMm,
               count = std::round(gap / PlanNeedle::kSpacerMm);
  if (count < 1 || count > kMostSpacers || std::abs(gap - count * PlanNeedle::kSpacerMm) > kSpacersOffMm)
    return;
  const Vec3 along = way / apart;
  if (std::abs(along.dot(a.axis)) < kSpacersInLine || std::abs(along.dot(b.axis)) < kSpacersInLine) return;
  const Look look{spacer_db_, 0.5 * kSeedDiameterMm, 5, 0.1, 0, 0, false};
  const Vec3 end = 0.5 * kSeedLengthMm * along;
  add_piece(X_IW, a.position + end, b.position - end, look, spread);
}

void InstrumentEchoes::add_piece(const RigidTransform& X_IW, const Vec3& begins, const Vec3& ends,
                                 const Look& look, const PointSpread& spread) noexcept {
  const Vec3 from = X_IW * begins, way = X_IW * ends - from;
  const double length = way.norm(), far = kFarOff * spread.elevation_sigma_mm();
  if (!(length > 0)) return;
  const Vec3 axis = way / length;
  // The part near the plane.
  double begin = 0, end = length;
  if (std::abs(axis.z()) > 1e-9) {
    const double a = (-far - from.z()) / axis.z(), b = (far - from.z()) / axis.z();
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  } else if (std::abs(from.z()) > far) {
    return;
  }
  if (end <= begin) return;
  const int count = static_cast<int>(std::ceil((end - begin) / kPieceMm));
  const double step = (end - begin) / count, level = std::pow(10, 0.05 * look.echo_db);
  for (int k = 0; k < count; ++k) {
    const Vec3 p = from + (begin + (k + 0.5) * step) * axis;
    const LinePoint at = plane_.find({p.x(), p.y()});
    if (!plane_.is_in_scan(at)) continue;
    const PlanePoint beam = plane_.beam(at.line);
    const Vec3 d(beam.a, beam.b, 0);
    const Vec3 facing = -(d - d.dot(axis) * axis);
    const double square_on = facing.norm();
    if (!(square_on > 1e-3)) continue;
    const Vec3 n = facing / square_on, side = axis.cross(n);
    const double e = p.z() / spread.elevation_sigma_mm(), in_slice = std::exp(-0.5 * e * e);
    const double angle = look.diffuse + (1 - look.diffuse) * std::pow(square_on, look.power);
    const double pressure = level * in_slice * angle * step;
    for (const double turn : {-kRoundSide, 0.0, kRoundSide}) {
      const Vec3 surface = p + look.radius * (std::cos(turn) * n + std::sin(turn) * side);
      add_point(surface, turn == 0 ? pressure : kRoundShare * pressure, look);
    }
    const double slice = in_slice / (spread.elevation_sigma_mm() * std::sqrt(2 * std::numbers::pi));
    if (look.has_shadow && shadow_count_ < shadows_.size())
      shadows_[shadow_count_++] = {at.line, at.depth, 2 * look.radius * step * square_on * slice};
  }
}

void InstrumentEchoes::add_point(const Vec3& p_I, double pressure, const Look& look) noexcept {
  PlanePoint p{p_I.x(), p_I.y()};
  const PlanePoint beam = plane_.beam(plane_.find(p).line);
  const double apart = 1.7 * look.radius;
  for (int k = 0; k <= look.repeats; ++k) {
    add_echo(p, pressure);
    p = {p.a + apart * beam.a, p.b + apart * beam.b};
    pressure *= look.reverberation;
  }
}

void InstrumentEchoes::add_echo(const PlanePoint& p, double pressure) noexcept {
  const LinePoint at = plane_.find(p);
  if (!plane_.is_in_scan(at) || echo_count_ == echoes_.size()) return;
  echoes_[echo_count_++] = {static_cast<float>(at.line), static_cast<float>(at.depth),
                            static_cast<float>(pressure)};
}

void InstrumentEchoes::add_losses(const PointSpread& spread, std::size_t segments,
                                  std::span<float> loss) const noexcept {
  const std::size_t nodes = segments + 1;
  for (std::size_t k = 0; k < shadow_count_; ++k) {
    const Shadow& shadow = shadows_[k];
    const double sigma = spread.lateral_mm(shadow.depth) / 2.355;
    const double wide = std::sqrt(sigma * sigma + radius_ * radius_ / 3);
    const double spacing = plane_.line_spacing_mm(shadow.depth);
    const auto node = static_cast<std::size_t>(shadow.depth / ScanSteps::kSegmentMm) + 1;
    if (node >= nodes) continue;
    const double reach = kShadowReach * wide / spacing;
    const auto first = static_cast<std::ptrdiff_t>(std::max(0.0, std::ceil(shadow.line - reach)));
    const auto last = static_cast<std::ptrdiff_t>(
        std::min(static_cast<double>(plane_.lines() - 1), std::floor(shadow.line + reach)));
    const double density = shadow_db_ * shadow.area / (wide * std::sqrt(2 * std::numbers::pi));
    for (std::ptrdiff_t l = first; l <= last; ++l) {
      const double x = (static_cast<double>(l) - shadow.line) * spacing / wide;
      loss[static_cast<std::size_t>(l) * nodes + node] +=
          static_cast<float>(density * std::exp(-0.5 * x * x));
    }
  }
}

}  // namespace brachy
