#include "core/elasticity/beam_columns.h"

#include <algorithm>
#include <array>
#include <numbers>

namespace brachy {
namespace {

constexpr double kNothing = 1e-12;  // of a support's own compliance: what rounding leaves

// Supports along one beam, and Cholesky's factor of the compliances between them.
class Supports {
 public:
  Supports(const Beam& beam, double least, double most) : beam_(beam) {
    // The spans at the ends are held at one side only, and so are shorter.
    const double spans = std::min(std::ceil((most - least) / BeamColumns::kSupportMm + 0.5),
                                  double{BeamColumns::kMostSupports - 1});
    count_ = most > least ? static_cast<std::size_t>(spans) + 1 : 1;
    const double span = (most - least) / std::max(1.0, spans - 0.5);
    for (std::size_t k = 0; k < count_; ++k) {
      const double at = least + span * (static_cast<double>(k) - 0.25);
      arcs_[k] = k == 0 ? least : k + 1 == count_ ? most : at;
      for (std::size_t q = 0; q < k; ++q) factor_[k][q] = column(arcs_[k], q, factor_[k].data());
      const double pivot = rest(arcs_[k], k, factor_[k].data());
      inverse_root_[k] = pivot > kNothing * beam.compliance(arcs_[k], arcs_[k]) ? 1 / std::sqrt(pivot) : 0;
      factor_[k][k] = pivot * inverse_root_[k];
    }
  }

  std::size_t count() const { return count_; }
  /// Of the row of U at arc length s the k-th number; `row`: those before.
  double column(double s, std::size_t k, const double* row) const {
    return rest(s, k, row) * inverse_root_[k];
  }

 private:
  // The compliance at s to a force at support k where the beam is held at all supports before.
  double rest(double s, std::size_t k, const double* row) const {
    double sum = beam_.compliance(s, arcs_[k]);
    for (std::size_t q = 0; q < k; ++q) sum -= row[q] * factor_[k][q];
    return sum;
  }

  using Row = std::array<double, BeamColumns::kMostSupports>;
  const Beam& beam_;
  std::size_t count_ = 0;
  Row arcs_{}, inverse_root_{};
  std::array<Row, BeamColumns::kMostSupports> factor_{};
};

}  // namespace

BeamColumns::BeamColumns(std::size_t max_landmarks) {
  rows_.reserve(max_landmarks);
  values_.reserve(max_landmarks * kMostSupports);
  sides_.reserve(2 * max_landmarks);
}

void BeamColumns::find(const LandmarkCompliance& compliance) noexcept {
  count_ = 0;
  norm_ = 0;
  rows_.clear();
  values_.clear();
  sides_.clear();
  for (std::size_t b = 0; b < compliance.beams().size(); ++b) add_beam(compliance, b);
}

void BeamColumns::add_beam(const LandmarkCompliance& compliance, std::size_t b) noexcept {
  const Beam& beam = compliance.beams()[b];
  const auto points = compliance.points();
  const auto is_on = [&](const LandmarkCompliance::Point& point) {
    return point.beam == static_cast<std::int32_t>(b);
  };
  double least = beam.length_mm, most = 0;
  for (const auto& point : points) {
    if (!is_on(point)) continue;
    least = std::min(least, point.arc_mm);
    most = std::max(most, point.arc_mm);
  }
  if (least > most) return;
  const Supports supports(beam, least, most);
  std::array<double, kMostSupports> sums{};
  const std::size_t first = values_.size();
  for (std::size_t l = 0; l < points.size(); ++l) {
    if (!is_on(points[l])) continue;
    rows_.push_back({l, count_, supports.count(), values_.size(), sides_.size()});
    std::array<double, kMostSupports> row{};
    for (std::size_t k = 0; k < supports.count(); ++k) {
      row[k] = supports.column(points[l].arc_mm, k, row.data());
      sums[k] += row[k];
      values_.push_back(row[k]);
    }
  }
  // All deflections have one sign, so that the sum of a row is its norm; across the needle it is √3 of that at most.
  for (std::size_t at = first; at < values_.size(); at += supports.count()) {
    double sum = 0;
    for (std::size_t k = 0; k < supports.count(); ++k) sum += values_[at + k] * sums[k];
    norm_ = std::max(norm_, std::numbers::sqrt3 * sum);
  }
  const Vec3 side = beam.axis.unitOrthogonal();
  sides_.push_back(side);
  sides_.push_back(beam.axis.cross(side));
  count_ += 2 * supports.count();
}

}  // namespace brachy
