#include "apps/score/explanation/tissue_causes.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace brachy {
namespace {

using Kind = Cause::Kind;

constexpr double kUnpuncturedMm = 3;  // less motion is no needle's that only indents the gland
constexpr double kUnlikeOthersMm = 2.5, kUnlikeSpreads = 4;
constexpr double kAlikeMm = 2;       // needles that moved together
constexpr double kMostUnlike = 0.5;  // of the needles; beyond, the others are the unlike ones
constexpr double kBinMm = 5;         // behind the tip: a seed or a spacer
constexpr double kLeastSwelling = 0.015, kMostSwelling = 0.3, kLeastExplained = 0.5;
constexpr std::size_t kLeastOfSwelling = 5;                  // needles
constexpr double kLeastGlandMm = 1, kLeastGlandShare = 0.1;  // mean; or of the seeds by kRightMm

double middle_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

TissueCauses::TissueCauses(const Deviations& deviations, Explanation& to)
    : deviations_(deviations), to_(to), is_apart_(deviations.tips.size(), 0) {
  for (const SeedDeviation& seed : deviations.seeds) rest_.push_back(seed.moved);
}

void TissueCauses::find() {
  set_apart();
  swelling();
  unpunctured();
  dragged();
  pushed();
  gland();
}

void TissueCauses::take(Cause cause) {
  for (std::size_t i = 0; i < rest_.size(); ++i) rest_[i] -= cause.part[i];
  to_.causes.push_back(std::move(cause));
}

std::vector<std::vector<std::size_t>> TissueCauses::needles(bool with_apart) const {
  std::vector<std::vector<std::size_t>> all;
  for (std::size_t i = 0; i < deviations_.seeds.size(); ++i) {
    if (is_apart_[deviations_.seeds[i].needle] && !with_apart) continue;
    if (all.empty() || deviations_.seeds[all.back().front()].needle != deviations_.seeds[i].needle)
      all.emplace_back();
    all.back().push_back(i);
  }
  return all;
}

bool TissueCauses::is_right(std::size_t i) const {
  const SeedDeviation& seed = deviations_.seeds[i];
  return seed.dropped.norm() <= kRightMm && (seed.dropped + seed.moved).norm() <= kRightMm;
}

void TissueCauses::set_apart() {
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const std::size_t n = deviations_.seeds[i].needle;
    if (n < deviations_.is_unpunctured.size() && deviations_.is_unpunctured[n] &&
        rest_[i].norm() > kUnpuncturedMm)
      is_apart_[n] = 1;
  }
}

// Without it, their seeds would have moved as the others' did.
void TissueCauses::unpunctured() {
  Cause cause(Kind::kUnpunctured, rest_.size());
  const std::vector<double> usual = usual_along();
  std::map<std::size_t, double> most;  // by needle
  double seeds = 0;
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const std::size_t n = deviations_.seeds[i].needle;
    if (!is_apart_[n]) continue;
    most[n] = std::max(most[n], rest_[i].norm());
    cause.part[i].z() = rest_[i].z() - usual[i];
    cause.shift += rest_[i];
    ++seeds;
  }
  for (const auto& [n, mm] : most) {
    cause.needles.push_back(n);
    cause.mm.push_back(mm);
  }
  if (cause.needles.empty()) return;
  cause.shift /= seeds;
  take(std::move(cause));
}

/// Of each seed: the middle of what seeds as far behind their tips moved along the needle.
std::vector<double> TissueCauses::usual_along() const {
  std::map<long, std::vector<double>> by_offset;
  const auto bin = [&](std::size_t i) { return std::lround(deviations_.seeds[i].offset_mm / kBinMm); };
  for (std::size_t i = 0; i < rest_.size(); ++i)
    if (!is_apart_[deviations_.seeds[i].needle]) by_offset[bin(i)].push_back(rest_[i].z());
  std::vector<double> all, usual;
  for (const auto& [offset, values] : by_offset) all.insert(all.end(), values.begin(), values.end());
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    const auto found = by_offset.find(bin(i));
    // A train as long as hardly another's is compared with all.
    usual.push_back(all.empty()                                             ? 0
                    : found != by_offset.end() && found->second.size() >= 3 ? middle_of(found->second)
                                                                            : middle_of(all));
  }
  return usual;
}

void TissueCauses::dragged() {
  const auto all = needles(false);
  if (all.size() < 3) return;
  const std::vector<double> usual = usual_along();
  std::vector<double> unlike;
  for (const auto& seeds : all) {
    std::vector<double> off;
    for (const std::size_t i : seeds) off.push_back(rest_[i].z() - usual[i]);
    unlike.push_back(largest_cluster<double>(off, kUnlikeOthersMm).mean);
  }
  const double reach = std::max(kUnlikeOthersMm, kUnlikeSpreads * inner_spread(unlike));
  std::vector<std::size_t> off;
  std::vector<double> by;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (std::abs(unlike[n]) > reach &&
        !std::ranges::all_of(all[n], [&](std::size_t i) { return is_right(i); })) {
      off.push_back(n);
      by.push_back(unlike[n]);
    }
  if (static_cast<double>(off.size()) > kMostUnlike * static_cast<double>(all.size())) return;
  while (!off.empty()) {
    const auto cluster = largest_cluster<double>(by, kAlikeMm);
    Cause cause(Kind::kDragged, rest_.size());
    cause.shift.z() = cluster.mean;
    for (const std::size_t m : cluster.members) {
      const auto& seeds = all[off[m]];
      cause.needles.push_back(deviations_.seeds[seeds.front()].needle);
      cause.mm.push_back(by[m]);
      for (const std::size_t i : seeds) cause.part[i].z() = by[m];
    }
    for (auto m = cluster.members.rbegin(); m != cluster.members.rend(); ++m) {
      off.erase(off.begin() + static_cast<std::ptrdiff_t>(*m));
      by.erase(by.begin() + static_cast<std::ptrdiff_t>(*m));
    }
    take(std::move(cause));
  }
}

// A gland that was larger by a share k when a seed fell at p: it rests at c + (p − c)/(1 + k). Across the needles,
// where they push least; the share is the one that leaves most needles in one place, or in two, as a probe may have
// pushed for some of them.
void TissueCauses::swelling() {
  const auto all = needles(false);
  if (all.size() < kLeastOfSwelling) return;
  const auto fell = [&](std::size_t i) -> Vec3 {
    return deviations_.seeds[i].planned + deviations_.seeds[i].dropped - deviations_.gland_centre;
  };
  const auto left_by = [&](double share) {
    std::vector<Vec2> off;
    for (const auto& seeds : all) {
      Vec2 sum = Vec2::Zero();
      for (const std::size_t i : seeds) sum += (rest_[i] + share * fell(i)).head<2>();
      off.push_back(sum / static_cast<double>(seeds.size()));
    }
    double squares = 0;
    for (int place = 0; place < 2 && !off.empty(); ++place) {
      const auto cluster = largest_cluster<Vec2>(off, kAlikeMm);
      for (auto m = cluster.members.rbegin(); m != cluster.members.rend(); ++m) {
        squares += (off[*m] - cluster.mean).squaredNorm();
        off.erase(off.begin() + static_cast<std::ptrdiff_t>(*m));
      }
    }
    return squares + kAlikeMm * kAlikeMm * static_cast<double>(off.size());
  };
  constexpr double kStep = 0.0025;
  double best = 0, least = left_by(0);
  const double without = least;
  for (double share = kLeastSwelling; share < kMostSwelling; share += kStep)
    if (const double left = left_by(share); left < least) {
      least = left;
      best = share;
    }
  if (best == 0 || least > (1 - kLeastExplained) * without) return;
  Cause cause(Kind::kSwelling, rest_.size());
  cause.is_of_all = true;
  cause.slope = best / (1 - best);
  to_.shrinks_by = best;
  for (std::size_t i = 0; i < rest_.size(); ++i) cause.part[i] = -best * fell(i);
  take(std::move(cause));
}

// Needles during which the gland lay elsewhere, such as under a probe that was pushed.
void TissueCauses::pushed() {
  const auto all = needles(true);
  if (all.size() < 4) return;
  std::vector<Vec2> by;
  for (const auto& seeds : all) {
    Vec2 sum = Vec2::Zero();
    for (const std::size_t i : seeds) sum += rest_[i].head<2>();
    by.push_back(sum / static_cast<double>(seeds.size()));
  }
  std::vector<double> x, y;
  for (const Vec2& v : by) {
    x.push_back(v.x());
    y.push_back(v.y());
  }
  const double reach = std::max(kRightMm, kUnlikeSpreads * std::max(inner_spread(x), inner_spread(y)));
  std::vector<Vec2> off;
  std::vector<std::size_t> which;
  for (std::size_t n = 0; n < all.size(); ++n)
    if (by[n].norm() > reach && !std::ranges::all_of(all[n], [&](std::size_t i) { return is_right(i); })) {
      off.push_back(by[n]);
      which.push_back(n);
    }
  if (off.size() < 2 || off.size() == all.size()) return;
  const auto cluster = largest_cluster<Vec2>(off, kAlikeMm);
  if (cluster.members.size() < 2) return;
  Cause cause(Kind::kPushed, rest_.size());
  cause.shift.head<2>() = cluster.mean;
  for (const std::size_t m : cluster.members) {
    cause.needles.push_back(deviations_.seeds[all[which[m]].front()].needle);
    for (const std::size_t i : all[which[m]]) cause.part[i].head<2>() = cluster.mean;
  }
  take(std::move(cause));
}

// What is left of the motion is the gland's as a whole, if it is more than a tissue that gives way and comes back.
void TissueCauses::gland() {
  double sum = 0, beyond = 0, front = 0;
  std::map<std::size_t, std::size_t> foremost;
  Cause cause(Kind::kGland, rest_.size());
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    cause.part[i] = rest_[i];
    sum += rest_[i].norm();
    beyond += rest_[i].norm() > kRightMm;
    if (foremost.try_emplace(deviations_.seeds[i].needle, i).second &&
        !is_apart_[deviations_.seeds[i].needle]) {
      cause.shift += rest_[i];
      ++front;
    }
  }
  const auto count = static_cast<double>(rest_.size());
  if (sum < kLeastGlandMm * count && beyond < kLeastGlandShare * count) return;
  cause.is_of_all = true;
  if (front > 0) cause.shift /= front;
  take(std::move(cause));
}

}  // namespace brachy
