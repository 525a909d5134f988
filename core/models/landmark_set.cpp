#include "core/models/landmark_set.h"

#include <algorithm>
#include <atomic>
#include <cassert>

namespace brachy {
namespace {

// A number is not given twice in a process, so that sets of different owners never share one by chance. Relaxed: a
// number only has to be unique; what it numbers is handed from thread to thread by other means.
std::uint64_t new_number() noexcept {
  static std::atomic<std::uint64_t> last{0};
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);  // real-time threads number, too
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}

std::uint64_t number_of(std::uint64_t settled, bool is_same) noexcept {
  return settled != 0 && is_same ? settled : new_number();
}

bool rests(const Vec3& a, const Vec3& b) noexcept {
  return ((a - b).cwiseAbs().array() <= LandmarkSet::kRestToleranceMm).all();  // not a number is no rest
}

}  // namespace

LandmarkSet LandmarkSet::of(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                            std::span<const LandmarkSpread> spreads, const LandmarkCompliance& compliance) {
  LandmarkSet set;
  set.assign(positions, displacements, spreads, compliance);
  return set;
}

void LandmarkSet::reserve(std::size_t capacity) {
  for (auto* v : {&positions, &displacements, &settled_.positions, &settled_.displacements})
    v->reserve(capacity);
  for (auto* v : {&spreads, &settled_.spreads}) v->reserve(capacity);
  for (auto* c : {&compliance, &settled_.compliance}) c->reserve(capacity, capacity);
  owners.reserve(capacity);
}

void LandmarkSet::clear() noexcept {
  positions.clear();
  displacements.clear();
  spreads.clear();
  owners.clear();
  compliance.clear();
  anchors = 0;
  revision_ = {};
}

void LandmarkSet::add(const Vec3& position, const Vec3& displacement, const LandmarkSpread& spread,
                      const LandmarkCompliance::Point& point) noexcept {
  compliance.add_landmark(point);
  positions.push_back(position);
  displacements.push_back(displacement);
  spreads.push_back(spread);
  revision_ = {};
}

void LandmarkSet::remove(std::size_t i) noexcept {
  spreads.erase(spreads.begin() + static_cast<std::ptrdiff_t>(i));
  compliance.remove_landmark(i);
  const auto removed = static_cast<std::int32_t>(i);
  for (LandmarkSpread& spread : spreads) {
    if (spread.behind == removed) spread.behind = -1;
    if (spread.behind > removed) --spread.behind;
  }
  if (i < anchors)
    --anchors;
  else
    owners.erase(owners.begin() + static_cast<std::ptrdiff_t>(i - anchors));
  revision_ = {};
}

void LandmarkSet::assign(std::span<const Vec3> new_positions, std::span<const Vec3> new_displacements,
                         std::span<const LandmarkSpread> new_spreads,
                         const LandmarkCompliance& new_compliance) {
  const std::size_t n = new_positions.size();
  clear();
  positions.assign(new_positions.begin(), new_positions.end());
  displacements.assign(new_displacements.begin(), new_displacements.end());
  displacements.resize(n, Vec3::Zero());
  spreads.assign(new_spreads.begin(), new_spreads.end());
  spreads.resize(n);
  compliance = new_compliance;
  while (compliance.points().size() < n) compliance.add_landmark({});
  number();
  settle();
}

void LandmarkSet::number() noexcept {
  const Revision& last = settled_.revision;
  revision_.positions = number_of(last.positions, positions == settled_.positions);
  revision_.spreads = number_of(last.spreads, spreads == settled_.spreads);
  revision_.compliance = number_of(last.compliance, compliance == settled_.compliance);
  revision_.held = number_of(last.held, revision_.compliance == last.compliance ||
                                            compliance.is_alike_without_beams(settled_.compliance));
  revision_.displacements = 0;
}

void LandmarkSet::settle() noexcept {
  assert(is_numbered());
  const Revision last = settled_.revision;
  revision_.displacements = last.displacements;
  const bool is_same = revision_ == last && std::ranges::equal(displacements, settled_.displacements, rests);
  revision_.displacements = number_of(last.displacements, is_same);
  if (revision_.positions != last.positions) settled_.positions = positions;
  if (revision_.spreads != last.spreads) settled_.spreads = spreads;
  if (revision_.compliance != last.compliance) settled_.compliance = compliance;
  if (revision_.displacements != last.displacements) settled_.displacements = displacements;
  settled_.revision = revision_;
}

LandmarkSet LandmarkSet::last_settled() const {
  LandmarkSet set;
  set.positions = settled_.positions;
  set.displacements = settled_.displacements;
  set.spreads = settled_.spreads;
  set.compliance = settled_.compliance;
  set.settled_ = settled_;
  set.revision_ = settled_.revision;
  return set;
}

void LandmarkSet::renumber(bool has_settled, bool is_settled) noexcept {
  settled_.revision = {};
  if (has_settled) settled_.revision = {new_number(), new_number(), new_number(), new_number(), new_number()};
  revision_ = is_settled ? settled_.revision : Revision();
}

bool LandmarkSet::is_numbered() const noexcept {
  const Revision& last = settled_.revision;
  const auto is_kept = [](const Vec3& a, const Vec3& b) { return a == b || !a.allFinite(); };
  return revision_.positions != 0 && spreads.size() == positions.size() &&
         displacements.size() == positions.size() &&
         (revision_.positions != last.positions ||
          std::ranges::equal(positions, settled_.positions, is_kept)) &&
         (revision_.spreads != last.spreads || spreads == settled_.spreads) &&
         (revision_.compliance != last.compliance || compliance == settled_.compliance);
}

}  // namespace brachy
