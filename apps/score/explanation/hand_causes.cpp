#include "apps/score/explanation/hand_causes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace brachy {
namespace {

using Kind = Cause::Kind;

constexpr double kLeastShiftMm = 1, kLeastDepthMm = 1.5, kLeastTurnMm = 2;  // of all needles: a mean is exact
constexpr double kMostRight = 0.1;    // of the needles may lie right and contradict a motion of all
constexpr double kLeastShare = 0.45;  // of the needles follow a motion of all
constexpr std::size_t kLeastOfAll = 3, kLeastOfTurn = 5;
constexpr double kGroupDepthMm = 1.8;
constexpr double kAcrossSpreads = 4, kAlongSpreads = 3.3, kSeedSpreads = 4;  // one in 3,000, 2,000 and 30,000
constexpr double kScatterAcrossMm = 1.2, kScatterAlongMm = 2;                // SD; less is a careful hand's
constexpr double kLeastFewDepthMm = 2.7;                                     // of one needle or two
constexpr double kRoleShare = 0.72;                                          // of what one seed must be off
constexpr double kThreeFifths = 0.8416;                                      // P(|z| < 0.8416) = 3/5
constexpr double kCarefulAlongMm = 0.85;                                     // SD of a careful hand
constexpr double kHoleMm = 1.5;                               // from a hole's middle: it went through it
constexpr double kLeastSpacing = 0.1, kLeastSpacingMm = 2.5;  // share, and over the train

double share_of(std::size_t part, std::size_t all) {
  return static_cast<double>(part) / static_cast<double>(all);
}

bool has(const std::vector<std::size_t>& all, std::size_t one) {
  return std::ranges::find(all, one) != all.end();
}

/// The best line through values at offsets with at most one outlier; its slope.
struct TrainLine {
  double slope = 0, largest_mm = 0;  // of what it leaves
  double constant_mm = 0;            // the same of a constant
};

TrainLine line_of(const std::vector<double>& at, const std::vector<double>& off) {
  const auto n = static_cast<double>(at.size());
  const double mean_at = std::accumulate(at.begin(), at.end(), 0.0) / n;
  const double mean_off = std::accumulate(off.begin(), off.end(), 0.0) / n;
  double squares = 0, products = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    squares += (at[i] - mean_at) * (at[i] - mean_at);
    products += (at[i] - mean_at) * (off[i] - mean_off);
  }
  TrainLine line{.slope = squares > 0 ? products / squares : 0};
  for (std::size_t i = 0; i < at.size(); ++i) {
    line.largest_mm = std::max(line.largest_mm, std::abs(off[i] - mean_off - line.slope * (at[i] - mean_at)));
    line.constant_mm = std::max(line.constant_mm, std::abs(off[i] - mean_off));
  }
  return line;
}

Kind kind_of(const PlaneMotion& motion) {
  return motion.kind == PlaneMotion::Kind::kShift  ? Kind::kAside
         : motion.kind == PlaneMotion::Kind::kTurn ? Kind::kTurned
                                                   : Kind::kMirrored;
}

}  // namespace

HandCauses::HandCauses(const Deviations& deviations, Explanation& to) : deviations_(deviations), to_(to) {
  for (const SeedDeviation& seed : deviations.seeds) rest_.push_back(seed.dropped);
  places_ = needle_places(deviations_, rest_);
}

void HandCauses::find() {
  spacing_of_all();
  template_motion();
  depth_of_all();
  spacing_of_needles();
  measure_scatter();
  exchanged();
  groups_across();
  groups_along();
  single_seeds();
  scatter();
}

void HandCauses::take(Cause cause) {
  const PlaneMotion& motion = to_.of_template;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    rest_[i] -= cause.part[i];
    cause.part[i].head<2>() = motion.carried(cause.part[i].head<2>());
  }
  to_.causes.push_back(std::move(cause));
  places_ = needle_places(deviations_, rest_);
}

// Trains that all came out longer or shorter: every two neighbouring seeds have a say.
void HandCauses::spacing_of_all() {
  std::vector<double> slopes;
  for (const NeedlePlace& place : places_)
    for (std::size_t k = 0; k + 1 < place.seeds.size(); ++k) {
      const SeedDeviation &a = deviations_.seeds[place.seeds[k]], &b = deviations_.seeds[place.seeds[k + 1]];
      if (b.offset_mm - a.offset_mm > 8)
        slopes.push_back((b.dropped.z() - a.dropped.z()) / (b.offset_mm - a.offset_mm));
    }
  if (slopes.size() < 8) return;
  const auto cluster = largest_cluster<double>(slopes, 0.1);
  if (share_of(cluster.members.size(), slopes.size()) < 0.6 || std::abs(cluster.mean) < kLeastSpacing) return;
  // By least squares of those that follow it: ends of a train say more than neighbours.
  double squares = 0, products = 0;
  for (const NeedlePlace& place : places_) {
    std::vector<double> at, off;
    for (const std::size_t i : place.seeds) {
      at.push_back(deviations_.seeds[i].offset_mm);
      off.push_back(deviations_.seeds[i].dropped.z() - cluster.mean * at.back());
    }
    const auto agreeing = largest_cluster<double>(off, kGroupDepthMm);
    double mean_at = 0, mean_off = 0;
    for (const std::size_t m : agreeing.members) {
      mean_at += at[m] / static_cast<double>(agreeing.members.size());
      mean_off += off[m] / static_cast<double>(agreeing.members.size());
    }
    for (const std::size_t m : agreeing.members) {
      squares += (at[m] - mean_at) * (at[m] - mean_at);
      products += (at[m] - mean_at) * (off[m] - mean_off);
    }
  }
  const double slope = cluster.mean + (squares > 0 ? products / squares : 0);
  Cause cause(Kind::kSpacing, rest_.size());
  cause.is_of_all = true;
  cause.slope = -slope;
  for (const NeedlePlace& place : places_) {
    cause.needles.push_back(place.needle);
    const double from = deviations_.seeds[place.seeds.front()].offset_mm;
    for (const std::size_t i : place.seeds)
      cause.part[i].z() = slope * (deviations_.seeds[i].offset_mm - from);
  }
  take(std::move(cause));
}

void HandCauses::spacing_of_needles() {
  for (const NeedlePlace& place : std::vector(places_)) {
    // Of three seeds, a line is no better than one that fell elsewhere.
    if (place.seeds.size() < 4 || place.follow_along.size() + 2 > place.seeds.size()) continue;
    std::vector<double> at, off;
    for (const std::size_t i : place.seeds) {
      at.push_back(deviations_.seeds[i].offset_mm);
      off.push_back(rest_[i].z());
    }
    const TrainLine line = line_of(at, off);
    if (std::abs(line.slope) < kLeastSpacing ||
        std::abs(line.slope) * (at.back() - at.front()) < 2 * kLeastSpacingMm || line.largest_mm > 1.5 ||
        line.constant_mm < 2 * line.largest_mm)
      continue;
    Cause cause(Kind::kSpacing, rest_.size());
    cause.needles = {place.needle};
    cause.slope = -line.slope;
    for (std::size_t k = 0; k < at.size(); ++k)
      cause.part[place.seeds[k]].z() = line.slope * (at[k] - at.front());
    take(std::move(cause));
  }
}

void HandCauses::template_motion() {
  if (places_.size() < kLeastOfAll) return;
  PlaneShifts shifts;
  for (const NeedlePlace& place : places_) {
    shifts.at.push_back(place.at);
    shifts.off.push_back(place.across);
  }
  double cheapest = cost_of_none(shifts);
  std::optional<MotionFit> best;
  for (const auto kind : {PlaneMotion::Kind::kShift, PlaneMotion::Kind::kTurn, PlaneMotion::Kind::kMirror}) {
    const std::size_t fewest = kind == PlaneMotion::Kind::kShift ? kLeastOfAll : kLeastOfTurn;
    const auto fit = best_motion(shifts, kind);
    if (!fit || fit->cost >= cheapest || fit->members.size() < fewest ||
        share_of(fit->members.size(), places_.size()) < kLeastShare)
      continue;
    std::size_t contradict = 0;
    double largest = 0;
    for (std::size_t p = 0; p < places_.size(); ++p) {
      const bool follows = has(fit->members, p);
      contradict += !follows && shifts.off[p].norm() < kRightMm;
      // A turn must be worth more than the shift that it comes with.
      const Vec2 along_with = kind == PlaneMotion::Kind::kShift ? Vec2(Vec2::Zero()) : fit->motion.shift;
      if (follows) largest = std::max(largest, (fit->motion.moved(shifts.at[p]) - along_with).norm());
    }
    if (share_of(contradict, places_.size()) > kMostRight) continue;
    if (largest < (kind == PlaneMotion::Kind::kShift ? kLeastShiftMm : kLeastTurnMm)) continue;
    cheapest = fit->cost;
    best = fit;
  }
  if (!best) return;
  const PlaneMotion& motion = best->motion;
  Cause cause(kind_of(motion), rest_.size());
  cause.is_of_all = true;
  cause.shift.head<2>() = motion.shift;
  cause.angle = motion.angle;
  cause.centre = motion.centre;
  for (const NeedlePlace& place : places_) {
    cause.needles.push_back(place.needle);
    for (const std::size_t i : place.seeds) cause.part[i].head<2>() = motion.moved(place.at);
  }
  take(std::move(cause));
  // From here on across is as the template has it, so that a needle in another hole of it is seen as that.
  to_.of_template = motion;
  for (Vec3& rest : rest_) rest.head<2>() = motion.carried_back(rest.head<2>());
  places_ = needle_places(deviations_, rest_);
}

void HandCauses::depth_of_all() {
  if (places_.size() < kLeastOfAll) return;
  std::vector<double> along;
  for (const NeedlePlace& place : places_) along.push_back(place.along);
  const auto cluster = largest_cluster<double>(along, kGroupDepthMm + 0.6);
  std::size_t contradict = 0;
  for (std::size_t p = 0; p < along.size(); ++p)
    contradict += !has(cluster.members, p) && std::abs(along[p]) < kRightMm;
  if (std::abs(cluster.mean) < kLeastDepthMm || share_of(contradict, along.size()) > kMostRight ||
      share_of(cluster.members.size(), along.size()) < kLeastShare)
    return;
  Cause cause(Kind::kDepth, rest_.size());
  cause.is_of_all = true;
  cause.shift.z() = to_.depth_of_all_mm = cluster.mean;
  for (const NeedlePlace& place : places_) {
    cause.needles.push_back(place.needle);
    for (const std::size_t i : place.seeds) cause.part[i].z() = cluster.mean;
  }
  take(std::move(cause));
}

void HandCauses::measure_scatter() {
  std::array<std::vector<double>, 3> of_seeds, of_needles;
  for (const Vec3& rest : rest_)
    for (int k = 0; k < 3; ++k) of_seeds[static_cast<std::size_t>(k)].push_back(rest[k]);
  for (const NeedlePlace& place : places_) {
    of_needles[0].push_back(place.across.x());
    of_needles[1].push_back(place.across.y());
    of_needles[2].push_back(place.along);
  }
  const auto spread = [](const auto& of, std::size_t k) { return inner_spread(of[k]); };
  const double across = std::max(spread(of_seeds, 0), spread(of_seeds, 1)), along = spread(of_seeds, 2);
  scatters_across_ = across > kScatterAcrossMm;
  scatters_along_ = along > kScatterAlongMm;
  across_mm_ = std::max(
      kRightMm, kAcrossSpreads * std::min(across, std::max(spread(of_needles, 0), spread(of_needles, 1))));
  // Of depths, the middle three fifths say more; not if less than that lie right, hence the bound.
  std::vector<double> size;
  for (const NeedlePlace& place : places_) size.push_back(std::abs(place.along));
  std::ranges::sort(size);
  const double usual = size.size() < kFewestForSpread ? 0 : size[size.size() * 3 / 5] / kThreeFifths;
  along_mm_ = std::max(kRightMm, kAlongSpreads * std::max(std::min(along, spread(of_needles, 2)),
                                                          std::min(usual, kCarefulAlongMm)));
  hole_mm_ = std::clamp(2.5 * std::min(across, std::max(spread(of_needles, 0), spread(of_needles, 1))), 0.5,
                        kHoleMm);
  seed_mm_ = std::max(3.0, kSeedSpreads * along);
  seed_across_mm_ = std::max(3.0, (kSeedSpreads + 0.7) * across);
}

bool HandCauses::is_right_across(const NeedlePlace& place) const {
  return std::ranges::all_of(place.follow_across, [&](std::size_t i) {
    return deviations_.seeds[i].dropped.head<2>().norm() <= kRightMm;
  });
}

bool HandCauses::is_right_along(const NeedlePlace& place) const {
  return std::ranges::all_of(place.follow_along, [&](std::size_t i) {
    return std::abs(deviations_.seeds[i].dropped.z()) <= kRightMm;
  });
}

std::size_t HandCauses::most_single() const {
  return std::max<std::size_t>(4, places_.size() / 3);
}

std::vector<std::size_t> HandCauses::off_across() const {
  std::vector<std::size_t> off;
  for (std::size_t p = 0; p < places_.size(); ++p)
    if (places_[p].across.norm() > across_mm_ && !is_right_across(places_[p])) off.push_back(p);
  return off;
}

// A needle in another's place goes as deep as the other should.
void HandCauses::take_depth_of(Cause& cause, const NeedlePlace& place, std::size_t as_planned_for) const {
  const double expected = deviations_.tips[as_planned_for].z() - deviations_.tips[place.needle].z();
  if (std::abs(expected) < 1 || std::abs(place.along - expected) > std::max(kRightMm, along_mm_) ||
      std::abs(place.along - expected) > std::abs(place.along))
    return;
  for (const std::size_t i : place.follow_along) cause.part[i].z() = expected;
}

void HandCauses::exchanged() {
  const std::vector<std::size_t> off = off_across();
  if (off.size() >= kLeastOfTurn + 1) {  // half of the template mirrored is no swap of each needle
    PlaneShifts shifts;
    for (const std::size_t p : off) {
      shifts.at.push_back(places_[p].at);
      shifts.off.push_back(places_[p].across);
    }
    const auto fit = best_motion(shifts, PlaneMotion::Kind::kMirror);
    if (fit && fit->members.size() > kLeastOfTurn && share_of(fit->members.size(), off.size()) >= 0.8) {
      std::vector<std::size_t> members;
      for (const std::size_t m : fit->members) members.push_back(off[m]);
      add_group(fit->motion, members);
      return;
    }
  }
  const std::size_t none = places_.size();
  std::vector<std::size_t> next(places_.size(), none);
  std::vector<Vec2> ways(places_.size(), Vec2::Zero());
  for (const std::size_t p : off) {
    // In another hole of the template, or where that hole should have been.
    double nearest = MotionFit::kReachMm;
    for (const std::size_t q : off)
      for (const Vec2& way : {Vec2(places_[q].at - places_[p].at),
                              to_.of_template.carried_back(places_[q].at - places_[p].at)}) {
        const double mm = (places_[p].across - way).norm();
        if (q == p || mm > nearest) continue;
        nearest = mm;
        next[p] = q;
        ways[p] = way;
      }
  }
  std::vector<Cause> found;
  std::vector<char> is_done(places_.size(), 0);
  for (const std::size_t p : off) {
    std::vector<std::size_t> ring;
    std::size_t q = p;
    while (q != none && !is_done[q] && !has(ring, q)) {
      ring.push_back(q);
      q = next[q];
    }
    if (q != p || ring.size() < 2 || is_done[p]) continue;
    Cause cause(Kind::kExchanged, rest_.size());
    for (const std::size_t r : ring) {
      is_done[r] = 1;
      cause.needles.push_back(places_[r].needle);
      for (const std::size_t i : places_[r].follow_across) cause.part[i].head<2>() = ways[r];
      take_depth_of(cause, places_[r], places_[next[r]].needle);
    }
    found.push_back(std::move(cause));
  }
  for (Cause& cause : found) take(std::move(cause));
}

void HandCauses::add_group(const PlaneMotion& motion, const std::vector<std::size_t>& members) {
  Cause cause(kind_of(motion), rest_.size());
  cause.shift.head<2>() = motion.shift;
  cause.angle = motion.angle;
  cause.centre = motion.centre;
  for (const std::size_t p : members) {
    cause.needles.push_back(places_[p].needle);
    cause.mm.push_back(places_[p].across.norm());
    for (const std::size_t i : places_[p].follow_across)
      cause.part[i].head<2>() = motion.moved(places_[p].at);
  }
  take(std::move(cause));
}

void HandCauses::add_elsewhere(const NeedlePlace& place) {
  Cause cause(Kind::kElsewhere, rest_.size());
  cause.needles = {place.needle};
  cause.shift.head<2>() = place.across;
  const double spacing = deviations_.hole_spacing_mm;
  const Vec2 hole(spacing * std::round(place.across.x() / spacing),
                  spacing * std::round(place.across.y() / spacing));
  // Through a hole: what is left is the play that it would have had in its own, too.
  const bool is_through = !hole.isZero() && (place.across - hole).norm() <= hole_mm_;
  for (const std::size_t i : place.follow_across) cause.part[i].head<2>() = is_through ? hole : place.across;
  if (is_through)
    for (std::size_t n = 0; n < deviations_.tips.size(); ++n)
      if ((deviations_.tips[n].head<2>() - place.at - hole).norm() < 0.1 * spacing)
        take_depth_of(cause, place, n);
  take(std::move(cause));
}

void HandCauses::groups_across() {
  if (scatters_across_) across_mm_ = std::max(across_mm_, 0.9 * deviations_.hole_spacing_mm);
  for (;;) {
    const std::vector<std::size_t> off = off_across();
    if (off.empty()) return;
    PlaneShifts shifts;
    for (const std::size_t p : off) {
      shifts.at.push_back(places_[p].at);
      shifts.off.push_back(places_[p].across);
    }
    MotionFit best = *best_motion(shifts, PlaneMotion::Kind::kShift);
    if (off.size() >= kLeastOfTurn)
      if (auto turn = best_motion(shifts, PlaneMotion::Kind::kTurn);
          turn && turn->members.size() >= std::max(kLeastOfTurn, best.members.size() + 2) &&
          turn->cost + 3 < best.cost)
        best = std::move(*turn);
    std::vector<std::size_t> members;
    for (const std::size_t m : best.members) members.push_back(off[m]);
    if (members.size() < 2) break;
    for (std::size_t p = 0; p < places_.size(); ++p)  // those that are off by less than single ones must be
      if (best.motion.kind == PlaneMotion::Kind::kShift && !has(members, p) &&
          places_[p].across.norm() > kRightMm && !is_right_across(places_[p]) &&
          (places_[p].across - best.motion.shift).norm() <= MotionFit::kReachMm)
        members.push_back(p);
    std::ranges::sort(members);
    add_group(best.motion, members);
  }
  const std::vector<std::size_t> single = off_across();
  if (single.size() > most_single()) {
    scatters_across_ = true;
    return;
  }
  const std::vector<NeedlePlace> before = places_;
  for (const std::size_t p : single) add_elsewhere(before[p]);
}

void HandCauses::groups_along() {
  std::vector<Cause> single;
  std::vector<char> is_done(places_.size(), 0);
  const double reach = std::max(kGroupDepthMm, 0.75 * along_mm_);
  for (;;) {
    std::vector<std::size_t> off;
    std::vector<double> along;
    for (std::size_t p = 0; p < places_.size(); ++p)
      if (!is_done[p] && std::abs(places_[p].along) > along_mm_ && !is_right_along(places_[p])) {
        off.push_back(p);
        along.push_back(places_[p].along);
      }
    if (off.empty()) break;
    const auto cluster = largest_cluster<double>(along, reach);
    if (cluster.members.empty()) break;
    Cause cause(Kind::kDepth, rest_.size());
    cause.shift.z() = cluster.mean;
    std::vector<std::size_t> members;
    for (const std::size_t m : cluster.members) members.push_back(off[m]);
    if (members.size() > 1)
      for (std::size_t p = 0; p < places_.size(); ++p)
        if (!is_done[p] && !has(members, p) && std::abs(places_[p].along) > kRightMm &&
            !is_right_along(places_[p]) && std::abs(places_[p].along - cluster.mean) <= reach)
          members.push_back(p);
    std::ranges::sort(members);
    for (const std::size_t p : members) {
      is_done[p] = 1;
      cause.needles.push_back(places_[p].needle);
      cause.mm.push_back(places_[p].along);
      for (const std::size_t i : places_[p].follow_along) cause.part[i].z() = cluster.mean;
    }
    if (std::abs(cluster.mean) < (members.size() > 2 ? kRightMm : kLeastFewDepthMm)) continue;
    if (members.size() == 1) {
      single.push_back(std::move(cause));
      continue;
    }
    take(std::move(cause));
  }
  if (single.size() > most_single()) {
    scatters_along_ = true;
    return;
  }
  for (Cause& cause : single) take(std::move(cause));
}

// The same seed of at least three trains, by the same distance.
void HandCauses::name_role(Kind kind, std::vector<char>& is_off) {
  const auto is_alike = [&](std::size_t i) {  // three that are alike need not be as far off as one
    return std::abs(rest_[i].z()) > kRoleShare * seed_mm_ && deviations_.seeds[i].dropped.norm() > kRightMm;
  };
  std::vector<std::size_t> seeds;
  std::vector<double> along;
  for (const NeedlePlace& place : places_) {
    if (place.seeds.size() < 2) continue;
    const std::size_t i = kind == Kind::kFront ? place.seeds.front() : place.seeds.back();
    if (!is_alike(i)) continue;
    seeds.push_back(i);
    along.push_back(rest_[i].z());
  }
  if (seeds.size() < 3) return;
  const auto cluster = largest_cluster<double>(along, std::max(2.5, seed_mm_ - 0.5));
  if (cluster.members.size() < 3) return;
  Cause cause(kind, rest_.size());
  cause.shift.z() = cluster.mean;
  for (const std::size_t m : cluster.members) {
    cause.needles.push_back(deviations_.seeds[seeds[m]].needle);
    cause.part[seeds[m]].z() = cluster.mean;
    is_off[seeds[m]] = 0;
  }
  cause.is_of_all = cause.needles.size() == places_.size();
  take(std::move(cause));
}

void HandCauses::single_seeds() {
  std::vector<char> is_off(rest_.size(), 0);
  for (std::size_t i = 0; i < rest_.size(); ++i)
    is_off[i] = (std::abs(rest_[i].z()) > seed_mm_ || rest_[i].head<2>().norm() > seed_across_mm_) &&
                deviations_.seeds[i].dropped.norm() > kRightMm;
  name_role(Kind::kFront, is_off);
  name_role(Kind::kBack, is_off);
  std::vector<Cause> found;
  for (const NeedlePlace& place : places_) {
    Cause cause(Kind::kSeeds, rest_.size());
    std::size_t count = 0;
    for (const std::size_t i : place.seeds)
      if (is_off[i]) {
        // Across, it may have no more than its needle's play.
        const bool is_aside = rest_[i].head<2>().norm() > seed_across_mm_;
        cause.part[i] = is_aside ? rest_[i] : Vec3(0, 0, rest_[i].z());
        cause.shift += cause.part[i];
        ++count;
      }
    if (count == 0) continue;
    cause.shift /= static_cast<double>(count);
    cause.needles = {place.needle};
    found.push_back(std::move(cause));
  }
  if (found.size() > most_single()) {
    scatters_along_ = true;
    return;
  }
  for (Cause& cause : found) take(std::move(cause));
}

void HandCauses::scatter() {
  const auto say = [&](Kind kind, int first, int count, double least) {
    Cause cause(kind, rest_.size());
    double squares = 0;
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      cause.part[i].segment(first, count) = rest_[i].segment(first, count);
      squares += cause.part[i].squaredNorm();
    }
    const double deviation = std::sqrt(squares / (count * static_cast<double>(rest_.size())));
    if (deviation < least) return;
    cause.is_of_all = true;
    cause.shift.z() = deviation;
    take(std::move(cause));
  };
  if (rest_.size() < kFewestForSpread) return;
  if (scatters_across_) say(Kind::kScatterAcross, 0, 2, kScatterAcrossMm);
  if (scatters_along_) say(Kind::kScatterAlong, 2, 1, kScatterAlongMm);
}

}  // namespace brachy
