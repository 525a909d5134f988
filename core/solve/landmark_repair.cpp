#include "core/solve/landmark_repair.h"

#include <limits>

namespace brachy {
namespace {

bool displacements_agree(const Vec3& d, const Vec3& e) {
  return (d - e).squaredNorm() <= kSameDisplacement * kSameDisplacement;
}

}  // namespace

std::optional<Duplicates> find_duplicates(std::span<const Vec3> positions,
                                          std::span<const Vec3> displacements, double distance,
                                          std::size_t from) noexcept {
  for (std::size_t second = from; second < positions.size(); ++second)
    for (std::size_t first = 0; first < second; ++first)
      if ((positions[first] - positions[second]).squaredNorm() < distance * distance)
        return Duplicates{first, second, displacements_agree(displacements[first], displacements[second])};
  return std::nullopt;
}

Repaired LandmarkRepair::drop(const FactorStatus& why) noexcept {
  if (positions_.size() < 2 || why || why.kind == FactorStatus::kNotFinite) return Repaired::kNothing;
  if (why.kind == FactorStatus::kDuplicate) {
    const auto first = static_cast<std::size_t>(why.first), second = static_cast<std::size_t>(why.second);
    return remove_one_of({first, second, displacements_agree(displacements_[first], displacements_[second])});
  }
  for (std::size_t k = 0; k < crowded_ && positions_.size() > 1; ++k) remove_one_of(closest_pair());
  crowded_ *= 2;
  return Repaired::kDropped;
}

Repaired LandmarkRepair::remove_one_of(const Duplicates& pair) noexcept {
  const std::size_t out = pair.second < anchors_ ? pair.second : pair.first;
  if (out < anchors_) --anchors_;
  if (removed_) removed_->push_back(out);
  for (auto* v : {&positions_, &displacements_}) v->erase(v->begin() + static_cast<std::ptrdiff_t>(out));
  return pair.agree ? Repaired::kMerged : Repaired::kDropped;
}

Duplicates LandmarkRepair::closest_pair() const noexcept {
  Duplicates closest;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t second = 1; second < positions_.size(); ++second)
    for (std::size_t first = 0; first < second; ++first) {
      const double distance = (positions_[first] - positions_[second]).squaredNorm();
      if (distance >= least) continue;
      least = distance;
      closest = {first, second};
    }
  return closest;
}

}  // namespace brachy
