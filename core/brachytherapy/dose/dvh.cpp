#include "core/brachytherapy/dose/dvh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace brachy {
namespace {

constexpr std::size_t kBinsPerPercent = 10;
constexpr auto kBins = static_cast<std::size_t>(100 * kHistogramEnd) * kBinsPerPercent;  // and one beyond
constexpr std::size_t kDvhPercents = 301;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Volumes by dose: the volume of each bin, the volume above its lower edge, and interpolation between.
class DoseHistogram {
 public:
  DoseHistogram(double prescription_gy)
      : bin_gy_(prescription_gy / (100 * kBinsPerPercent)), volume_(kBins + 1) {}

  // Where seeds were taken out again (a negative strength) rounding may leave a dose below 0.
  void add(double gy, double volume) {
    const double bin = gy > 0 ? gy / bin_gy_ : 0;
    volume_[bin < static_cast<double>(kBins) ? static_cast<std::size_t>(bin) : kBins] += volume;
  }

  // To be called once, after the last add.
  void sum_up(double max_gy) {
    max_gy_ = max_gy;
    above_.assign(kBins + 2, 0);
    for (std::size_t i = kBins + 1; i-- > 0;) above_[i] = above_[i + 1] + volume_[i];
  }
  double total() const { return above_[0]; }
  double at_least_percent(std::size_t percent) const { return above_[percent * kBinsPerPercent]; }
  // The minimum dose to the hottest `volume`; 0 ≤ volume ≤ total().
  double dose_of(double volume) const {
    // The last bin above whose lower edge lies at least that volume.
    const auto found =
        std::partition_point(above_.begin(), above_.end(), [&](double v) { return v >= volume; });
    const std::size_t i =
        std::clamp<std::size_t>(static_cast<std::size_t>(found - above_.begin()), 1, kBins + 1) - 1;
    const double lower = bin_gy_ * static_cast<double>(i);
    const double upper = i == kBins ? std::max(max_gy_, lower) : lower + bin_gy_;
    return volume_[i] > 0 ? std::min(lower + (upper - lower) * (above_[i] - volume) / volume_[i], max_gy_)
                          : lower;
  }

 private:
  double bin_gy_, max_gy_ = 0;
  std::vector<double> volume_, above_;
};

}  // namespace

StructureDose structure_dose(std::string name, double volume_cc, std::span<const DoseSample> samples,
                             double prescription_gy) {
  StructureDose result;
  result.name = std::move(name);
  result.volume_cc = volume_cc;
  result.volume_share.assign(kDvhPercents, 0);
  DoseHistogram histogram(prescription_gy);
  double sum = 0, max = 0, min = std::numeric_limits<double>::infinity();
  for (const auto& [gy, volume] : samples) {
    histogram.add(gy, volume);
    sum += volume * gy;
    max = std::max(max, gy);
    min = std::min(min, gy);
  }
  histogram.sum_up(max);
  const double total = histogram.total();
  if (!(total > 0)) {
    result.mean_gy = result.min_gy = result.max_gy = kNaN;
    result.d90_gy = result.d30_gy = result.d10_gy = result.d2cc_gy = result.d5_gy = result.d0_1cc_gy = kNaN;
    return result;
  }
  result.mean_gy = sum / total;
  result.min_gy = min;
  result.max_gy = max;
  for (std::size_t k = 0; k < kDvhPercents; ++k)
    result.volume_share[k] = static_cast<float>(histogram.at_least_percent(k) / total);
  result.v100_percent = 100 * histogram.at_least_percent(100) / total;
  result.v150_percent = 100 * histogram.at_least_percent(150) / total;
  result.v200_percent = 100 * histogram.at_least_percent(200) / total;
  result.v100_cc = result.volume_cc * result.v100_percent / 100;
  result.d90_gy = histogram.dose_of(0.9 * total);
  result.d30_gy = histogram.dose_of(0.3 * total);
  result.d10_gy = histogram.dose_of(0.1 * total);
  const auto hottest = [&](double cc) {
    return result.volume_cc < cc ? kNaN : histogram.dose_of(cc / result.volume_cc * total);
  };
  result.d2cc_gy = hottest(2);
  result.d0_1cc_gy = hottest(0.1);
  result.d5_gy = histogram.dose_of(0.05 * total);
  return result;
}

StructureDose structure_dose(std::string name, const StructureVoxels& voxels, const DoseGrid& grid,
                             double prescription_gy) {
  std::vector<DoseSample> samples;
  samples.reserve(voxels.whole.size() + voxels.parts.size());
  const double voxel_mm3 = std::pow(grid.spacing_mm(), 3);
  for (const std::uint32_t voxel : voxels.whole)
    samples.push_back({static_cast<double>(grid.dose_gy()[voxel]), voxel_mm3});
  for (const StructureVoxels::Part& part : voxels.parts)
    samples.push_back({grid.at(part.centre), part.volume_mm3});
  return structure_dose(std::move(name), voxels.volume_cc, samples, prescription_gy);
}

}  // namespace brachy
