#include "core/brachytherapy/hdr/dwell_optimiser.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/brachytherapy/dose/dose_rate.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

// Dwells on a line through the phantom beside its urethra, and few points.
struct SmallProblem {
  std::vector<Dwell> dwells;
  DwellDoses doses;

  SmallProblem()
      : dwells(line()),
        doses(dwells, dose_points(load_structures(Scene()), 0.1), SourceModel::kMicroSelectronV2, 40000,
              13.5) {}

  static std::vector<Dwell> line() {
    std::vector<Dwell> all;
    for (const Vec3& at : {Vec3(12, 0, 0), Vec3(-12, 0, 0), Vec3(12, -10, 0), Vec3(-12, -10, 0)})
      for (int i = -3; i <= 3; ++i) all.push_back({0, 0, at + 5.0 * i * Vec3::UnitZ(), Vec3::UnitZ(), 0});
    return all;
  }
};

double value_of(const DwellDoses& doses, const std::vector<DwellPenalty>& penalties,
                const std::vector<double>& t) {
  double sum = 0;
  for (const DwellDoses::Rows& rows : doses.structures())
    for (const DwellPenalty& p : penalties) {
      if (p.role != rows.role) continue;
      for (const double d : doses.doses(rows, t)) {
        const double lacking = std::max(p.least - d, 0.0), excess = std::max(d - p.most, 0.0);
        sum += (p.least_weight * lacking * lacking + p.most_weight * excess * excess) /
               static_cast<double>(rows.count);
      }
    }
  return sum;
}

TEST(DwellOptimiser, NoSmallChangeOfATimeIsBetterThanTheMinimum) {
  const SmallProblem small;
  const std::vector<DwellPenalty> penalties = default_penalties();
  const std::vector<double> t =
      minimise_penalties({&small.doses, 1}, penalties, std::vector<double>(small.dwells.size(), 5), 3000);
  const double least = value_of(small.doses, penalties, t);
  for (std::size_t j = 0; j < t.size(); ++j)
    for (const double change : {-0.2, 0.2}) {
      std::vector<double> other = t;
      other[j] = std::max(0.0, t[j] + change);
      EXPECT_GE(value_of(small.doses, penalties, other), least * (1 - 1e-9)) << j;
    }
  EXPECT_GE(*std::ranges::min_element(t), 0);
}

TEST(DwellOptimiser, TimesComeInStepsOfAnAfterloader) {
  const SmallProblem small;
  for (const double s : optimise_dwell_times(small.doses)) EXPECT_EQ(s, std::round(10 * s) / 10);
}

TEST(DwellDoses, AreThoseOfTheSeedsThatStandForTheDwells) {
  SmallProblem small;
  std::vector<double> times(small.dwells.size());
  for (std::size_t j = 0; j < times.size(); ++j) small.dwells[j].seconds = times[j] = static_cast<double>(j);
  const auto points = dose_points(load_structures(Scene()), 0.1);
  const auto seeds = as_seeds(small.dwells, SourceModel::kMicroSelectronV2, 40000);
  std::vector<double> exact;
  for (const Vec3& p : points[0].points) exact.push_back(total_dose_gy(seeds, p) / 13.5);
  std::ranges::sort(exact, std::greater());
  const std::vector<double> doses = small.doses.doses(small.doses.structures()[0], times);
  ASSERT_EQ(doses.size(), exact.size());
  for (std::size_t i = 0; i < doses.size(); ++i) EXPECT_NEAR(doses[i] / exact[i], 1, 1e-12);
}

TEST(HdrFigures, MissedGoalsAddUpByTheirShare) {
  HdrFigures figures{98, 30, 110, 60, 0};
  EXPECT_EQ(figures.missed(), 0);
  figures.v150_percent = 38.5;
  EXPECT_NEAR(figures.missed(), 0.1, 1e-12);
  figures.v100_percent = 94;
  EXPECT_NEAR(figures.missed(), 1.1, 1e-12);
}

}  // namespace
}  // namespace brachy
