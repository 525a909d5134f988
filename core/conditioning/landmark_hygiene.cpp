#include "core/conditioning/landmark_hygiene.h"

#include <limits>

namespace brachy {
namespace {

bool say_the_same(const Vec3& d, const Vec3& e) {
  return (d - e).squaredNorm() <= kSameDisplacement * kSameDisplacement;
}

}  // namespace

std::optional<Twins> find_twins(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                                double distance, std::size_t from) noexcept {
  for (std::size_t second = from; second < positions.size(); ++second)
    for (std::size_t first = 0; first < second; ++first)
      if ((positions[first] - positions[second]).squaredNorm() < distance * distance)
        return Twins{first, second, say_the_same(displacements[first], displacements[second])};
  return std::nullopt;
}

Mended LandmarkMender::mend(const FactorStatus& why) noexcept {
  if (positions_.size() < 2 || why || why.kind == FactorStatus::kNotFinite) return Mended::kNothing;
  if (why.kind == FactorStatus::kDuplicate) {
    const auto first = static_cast<std::size_t>(why.first), second = static_cast<std::size_t>(why.second);
    return take_out_one_of({first, second, say_the_same(displacements_[first], displacements_[second])});
  }
  for (std::size_t k = 0; k < crowded_ && positions_.size() > 1; ++k) take_out_one_of(closest_pair());
  crowded_ *= 2;
  return Mended::kDropped;
}

Mended LandmarkMender::take_out_one_of(const Twins& pair) noexcept {
  const std::size_t out = pair.second < anchors_ ? pair.second : pair.first;
  if (out < anchors_) --anchors_;
  if (taken_out_) taken_out_->push_back(out);
  for (auto* v : {&positions_, &displacements_}) v->erase(v->begin() + static_cast<std::ptrdiff_t>(out));
  return pair.agree ? Mended::kMerged : Mended::kDropped;
}

Twins LandmarkMender::closest_pair() const noexcept {
  Twins closest;
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
