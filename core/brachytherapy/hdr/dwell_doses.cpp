#include "core/brachytherapy/hdr/dwell_doses.h"

#include <algorithm>
#include <cmath>

#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/source.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/geometry/surface/surface_volume.h"
#include "core/geometry/tissue/interior_points.h"

namespace brachy {
namespace {

// A sixth of a cubic millimetre of urethra, six of the gland: what D2cc and the percents need to be within 0.5 %.
constexpr double kTargetPoints = 4000, kUrethraPoints = 1000, kOrganPoints = 1500;

double share_at_least(const std::vector<double>& decreasing, double dose) {
  const auto end = std::ranges::lower_bound(decreasing, dose, std::greater());
  return static_cast<double>(end - decreasing.begin()) / static_cast<double>(decreasing.size());
}

// The least dose of the hottest `share`.
double dose_of(const std::vector<double>& decreasing, double share) {
  const auto i = static_cast<std::size_t>(share * static_cast<double>(decreasing.size()));
  return decreasing[std::min(i, decreasing.size() - 1)];
}

}  // namespace

std::vector<DoseGoal> hdr_dose_goals() {
  std::vector<DoseGoal> goals;
  for (const char* stage : {"plan", "implant"}) {
    const auto add = [&](const char* structure, const char* figure, const char* side, double limit) {
      goals.push_back({structure, figure, stage, side, limit, "GEC/ESTRO 2013 and stricter"});
    };
    add("prostate", "V100", "above", HdrGoals::kLeastV100);
    add("prostate", "V150", "below", HdrGoals::kMostV150);
    add("urethra", "D10", "below", HdrGoals::kMostUrethraD10);
    add("rectum", "D2cc", "below", HdrGoals::kMostD2cc);
    add("bladder", "D2cc", "below", HdrGoals::kMostD2cc);
  }
  return goals;
}

DosePoints::Role DosePoints::role_of(std::string_view name) {
  if (name == "urethra") return Role::kUrethra;
  if (name == "rectum") return Role::kRectum;
  if (name == "bladder") return Role::kBladder;
  return Role::kOther;
}

std::vector<DosePoints> dose_points(const std::vector<Structure>& structures, double share) {
  std::vector<DosePoints> all;
  for (std::size_t i = 0; i < structures.size(); ++i) {
    const Structure& s = structures[i];
    const DosePoints::Role role = i == 0 ? DosePoints::Role::kTarget : DosePoints::role_of(s.name);
    if (role == DosePoints::Role::kOther) continue;
    const double count = role == DosePoints::Role::kTarget    ? kTargetPoints
                         : role == DosePoints::Role::kUrethra ? kUrethraPoints
                                                              : kOrganPoints;
    all.push_back({role,
                   fill_interior(SurfaceBvh(s.mesh), static_cast<std::size_t>(share * count), 1, s.name),
                   1e-3 * enclosed_mm3(s.mesh)});
  }
  return all;
}

DwellDoses::DwellDoses(const std::vector<Dwell>& positions, const std::vector<DosePoints>& structures,
                       SourceModel source, double source_strength_u, double prescription_gy)
    : dwells_(positions.size()) {
  const Tg43Source& data = tg43_source(source);
  const double share_per_cgy_h = source_strength_u * 0.01 / 3600 / prescription_gy;
  std::size_t rows = 0;
  for (const DosePoints& s : structures) {
    structures_.push_back({s.role, rows, s.points.size(), s.volume_cc});
    rows += s.points.size();
  }
  share_per_s_.reserve(rows * dwells_);
  for (const DosePoints& s : structures)
    for (const Vec3& p : s.points)
      for (const Dwell& dwell : positions) {
        const Vec3 d = p - dwell.position;
        share_per_s_.push_back(share_per_cgy_h *
                               dose_rate_per_u(data, d.dot(dwell.axis), dwell.axis.cross(d).norm()));
      }
}

std::vector<double> DwellDoses::doses(const Rows& structure, const std::vector<double>& seconds) const {
  std::vector<double> all(structure.count);
  for (std::size_t i = 0; i < structure.count; ++i) {
    const double* share = row(structure.first + i);
    for (std::size_t j = 0; j < dwells_; ++j) all[i] += share[j] * seconds[j];
  }
  std::ranges::sort(all, std::greater());
  return all;
}

DwellDoses DwellDoses::with(const std::vector<std::size_t>& dwells) const {
  DwellDoses some;
  some.dwells_ = dwells.size();
  some.structures_ = structures_;
  const std::size_t rows = share_per_s_.size() / dwells_;
  some.share_per_s_.reserve(rows * dwells.size());
  for (std::size_t i = 0; i < rows; ++i)
    for (const std::size_t j : dwells) some.share_per_s_.push_back(row(i)[j]);
  return some;
}

double HdrFigures::missed(double margin) const {
  const auto below = [&](double value, double least) {
    return std::max(0.0, least * (1 + margin) - value) / least;
  };
  const auto above = [&](double value, double most) {
    return std::max(0.0, value - most * (1 - margin)) / most;
  };
  // Percent of uncovered volume count as the share of what may be uncovered.
  return below(v100_percent, HdrGoals::kLeastV100) * HdrGoals::kLeastV100 / (100 - HdrGoals::kLeastV100) +
         above(v150_percent, HdrGoals::kMostV150) + above(urethra_d10_percent, HdrGoals::kMostUrethraD10) +
         above(rectum_d2cc_percent, HdrGoals::kMostD2cc) + above(bladder_d2cc_percent, HdrGoals::kMostD2cc);
}

HdrFigures hdr_figures(const DwellDoses& doses, const std::vector<double>& seconds) {
  using Role = DosePoints::Role;
  HdrFigures figures;
  for (const DwellDoses::Rows& structure : doses.structures()) {
    const std::vector<double> of = doses.doses(structure, seconds);
    const double d2cc = structure.volume_cc < 2 ? 0 : 100 * dose_of(of, 2 / structure.volume_cc);
    if (structure.role == Role::kTarget) {
      figures.v100_percent = 100 * share_at_least(of, 1);
      figures.v150_percent = 100 * share_at_least(of, 1.5);
    }
    if (structure.role == Role::kUrethra) figures.urethra_d10_percent = 100 * dose_of(of, 0.1);
    if (structure.role == Role::kRectum) figures.rectum_d2cc_percent = d2cc;
    if (structure.role == Role::kBladder) figures.bladder_d2cc_percent = d2cc;
  }
  return figures;
}

}  // namespace brachy
