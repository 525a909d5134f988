#include "core/needle/cut_path.h"

#include <algorithm>
#include <cmath>

namespace brachy {

CutPath::CutPath(double length) : capacity_(static_cast<std::size_t>(std::ceil(length / kResolution)) + 2) {
  knots_.reserve(capacity_);
}

void CutPath::start(const Vec3& entry) noexcept {
  knots_.clear();
  knots_.push_back({entry, 0});
  end_ = entry;
  end_length_ = 0;
}

void CutPath::extend_to(const Vec3& point) noexcept {
  const Knot& last = knots_.back();
  const double s = last.s + (point - last.point).norm();
  if (s - last.s >= kResolution) {
    if (knots_.size() == capacity_) return;
    knots_.push_back({point, s});
  }
  end_ = point;
  end_length_ = s;
}

void CutPath::cut_off(double s) noexcept {
  if (s >= end_length_) return;
  end_ = at(s);
  end_length_ = std::max(0.0, s);
  while (knots_.size() > 1 && knots_.back().s > end_length_) knots_.pop_back();
}

Vec3 CutPath::at(double s) const noexcept {
  if (s >= end_length_) return end_;
  if (s <= 0) return knots_.front().point;
  const auto next =
      std::upper_bound(knots_.begin(), knots_.end(), s, [](double v, const Knot& k) { return v < k.s; });
  const Knot& a = *(next - 1);
  const Knot b = next == knots_.end() ? Knot{end_, end_length_} : *next;
  return a.point + (s - a.s) / (b.s - a.s) * (b.point - a.point);
}

}  // namespace brachy
