#include "core/brachytherapy/plan/optimiser/dose_rows.h"

#include <array>

#include "core/brachytherapy/dose/dose_loops.h"

namespace brachy {
namespace {

constexpr std::size_t kTile = PlanPoints::kGroup;  // points whose depths are computed before they are stored

}  // namespace

DoseRows::DoseRows(const std::vector<NeedleChoice>& choices, const PlanPoints& points, SourceModel source,
                   double strength_u, double prescription_gy)
    : points_(points.points.size()) {
  std::size_t rows = 0;
  for (const NeedleChoice& choice : choices) {
    first_.push_back(rows);
    lowest_.push_back(choice.first_row);
    rows += static_cast<std::size_t>(choice.last_row - choice.first_row + 1);
  }
  doses_.resize(rows * points_);
  const DoseTables& tables = dose_tables(source);
  const DoseLoops& loops = dose_loops(SimdTarget::kGeneric);
  const auto scale = static_cast<float>(strength_u / prescription_gy);
  std::vector<float> tile;
  for (std::size_t c = 0; c < choices.size(); ++c) {
    const NeedleChoice& choice = choices[c];
    const auto depths = static_cast<std::size_t>(choice.last_row - choice.first_row + 1);
    const double first_z = choice.position.z() + row_depth_mm(choice.first_row);
    for (std::size_t start = 0; start < points_; start += kTile) {
      tile.assign(kTile * depths, 0);
      for (std::size_t k = 0; k < kTile; ++k) {
        const Vec3 d = points.points[start + k] - choice.position;
        // The seed moves by 0.5 mm from depth to depth, so the point goes back along its axis.
        const DoseRow row{static_cast<float>(points.points[start + k].z() - first_z),
                          -0.5f,
                          {static_cast<float>(-d.y()), static_cast<float>(d.x()), 0},
                          {0, 0, 0}};
        loops.add_row(tables, row, scale, depths, &tile[k * depths]);
      }
      for (std::size_t depth = 0; depth < depths; ++depth) {
        float* out = &doses_[(first_[c] + depth) * points_ + start];
        for (std::size_t k = 0; k < kTile; ++k) out[k] = tile[k * depths + depth];
      }
    }
  }
}

}  // namespace brachy
