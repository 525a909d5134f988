#include "core/brachytherapy/plan/optimiser/placement_noise.h"

#include <algorithm>
#include <cmath>

#include "core/base/repeatable_random.h"
#include "core/brachytherapy/dose/dose_rate.h"

namespace brachy {
namespace {

constexpr float kTableStepMm = 0.25f;
constexpr int kAway = 320, kAlong = 320;  // steps: 80 mm

}  // namespace

MisplacedDose::MisplacedDose(PlanDose& planned, const std::vector<NeedleChoice>& choices,
                             const PlanPoints& points, const PointObjective& objective, SourceModel source,
                             double strength_u, double prescription_gy, const PlacementNoise& noise,
                             double weight, std::vector<float> placed)
    : planned_(planned),
      choices_(choices),
      objective_(objective),
      weight_(weight),
      draws_(noise.draws),
      table_(static_cast<std::size_t>(kAway) * kAlong),
      placed_(std::move(placed)) {
  for (const Vec3& p : points.points) {
    x_.push_back(static_cast<float>(p.x()));
    y_.push_back(static_cast<float>(p.y()));
    z_.push_back(static_cast<float>(p.z()));
  }
  placed_.resize(x_.size(), 0);
  const double scale = strength_u * total_gy_per_cgy_h(source) / prescription_gy;
  for (int i = 0; i < kAway; ++i)
    for (int j = 0; j < kAlong; ++j)
      table_[static_cast<std::size_t>(i * kAlong + j)] = static_cast<float>(
          scale * dose_rate_per_u(tg43_source(source), static_cast<double>(kTableStepMm) * j,
                                  static_cast<double>(kTableStepMm) * i));
  RepeatableRandom random(noise.seed);
  offsets_.resize(draws_ * choices_.size() * NeedleLoad::kMostElements);
  for (Vec3& offset : offsets_)
    for (int k = 0; k < 3; ++k) offset[k] = (k == 2 ? noise.along_mm : 0) + noise.sd_mm[k] * random.normal();
  for (std::size_t draw = 0; draw < draws_; ++draw)
    strengths_.push_back(static_cast<float>(1 + noise.strength_percent / 100 * random.normal()));
  dose_.assign(draws_, std::vector<float>(x_.size()));
  changed_ = dose_;
}

void MisplacedDose::add_seed(std::size_t draw, std::size_t choice, int ordinal, int row, float sign,
                             float* dose) const {
  const Vec3 seed =
      choices_[choice].position + row_depth_mm(row) * Vec3::UnitZ() + offset(draw, choice, ordinal);
  const auto sx = static_cast<float>(seed.x()), sy = static_cast<float>(seed.y()),
             sz = static_cast<float>(seed.z());
  const float* table = table_.data();
  const float strength = sign * strengths_[draw];
  for (std::size_t i = 0; i < x_.size(); ++i) {
    const float dx = x_[i] - sx, dy = y_[i] - sy;
    const float away = std::sqrt(dx * dx + dy * dy) * (1 / kTableStepMm) + 0.5f,
                along = std::abs(z_[i] - sz) * (1 / kTableStepMm) + 0.5f;
    const int a = std::min(static_cast<int>(away), kAway - 1),
              b = std::min(static_cast<int>(along), kAlong - 1);
    dose[i] += strength * table[a * kAlong + b];
  }
}

double MisplacedDose::reset(std::span<const NeedleLoad> loads) {
  double sum = 0;
  std::array<int, NeedleLoad::kMostElements> rows;
  for (std::size_t draw = 0; draw < draws_; ++draw) {
    dose_[draw] = placed_;
    for (std::size_t c = 0; c < loads.size(); ++c) {
      const int count = loads[c].is_used() ? loads[c].seed_rows(rows) : 0;
      for (int s = 0; s < count; ++s)
        add_seed(draw, c, s, rows[static_cast<std::size_t>(s)], 1, dose_[draw].data());
    }
    sum += objective_.of(dose_[draw].data());
  }
  return planned_.reset(loads) + weight_ * sum / static_cast<double>(draws_);
}

double MisplacedDose::with(std::span<const LoadChange> changes) {
  double sum = 0;
  std::array<int, NeedleLoad::kMostElements> before, after;
  for (std::size_t draw = 0; draw < draws_; ++draw) {
    changed_[draw] = dose_[draw];
    float* dose = changed_[draw].data();
    for (const LoadChange& change : changes) {
      const int n = change.before.is_used() ? change.before.seed_rows(before) : 0;
      const int m = change.after.is_used() ? change.after.seed_rows(after) : 0;
      for (int s = 0; s < std::max(n, m); ++s) {
        const auto at = static_cast<std::size_t>(s);
        if (s < n && s < m && before[at] == after[at]) continue;
        if (s < n) add_seed(draw, change.choice, s, before[at], -1, dose);
        if (s < m) add_seed(draw, change.choice, s, after[at], 1, dose);
      }
    }
    sum += objective_.of(dose);
  }
  return planned_.with(changes) + weight_ * sum / static_cast<double>(draws_);
}

void MisplacedDose::keep() {
  planned_.keep();
  std::swap(dose_, changed_);
}

}  // namespace brachy
