#include "apps/import/check/dose_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <Eigen/Dense>
#include <iomanip>
#include <optional>
#include <sstream>

#include "core/base/error.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/dose/structure_voxels.h"

namespace brachy {
namespace {

constexpr std::size_t kFewPoints = 1500;  // what the fits go by
constexpr double kWrongFrame = 0.03;      // a frame's median ratio, off that of all, at the best shift
constexpr std::size_t kLeastOfFrame = 5;  // points, for a median
constexpr double kNotedShiftMm = 0.25;    // and a fall of the root mean square by a fifth
constexpr double kNotedScale = 0.01;
constexpr double kNotedOutsidePercent = 1;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

std::vector<DoseSeed> moved_along(std::vector<DoseSeed> seeds, double mm) {
  for (DoseSeed& seed : seeds) seed.position += mm * seed.axis;
  return seeds;
}

std::vector<DoseSeed> of_source(std::vector<DoseSeed> seeds, SourceModel model) {
  for (DoseSeed& seed : seeds) {
    // The same strength times time: the strength of a seed is of its own half-life.
    seed.air_kerma_strength_u *= total_gy_per_cgy_h(seed.source) / total_gy_per_cgy_h(model);
    seed.source = model;
  }
  return seeds;
}

/// A shift of the file's grid, and a scale of its dose, by which differences are least.
struct Shift {
  Vec3 mm = Vec3::Zero();
  double scale = 1;  ///< file / recomputed
};

class Comparison {
 public:
  Comparison(const VoxelVolume& dose, const std::vector<DoseSeed>& seeds, const DoseCheckSettings& settings)
      : dose_(dose) {
    const double beside2 = settings.beside_mm * settings.beside_mm;
    std::size_t n = 0;
    for (std::size_t k = 0; k < dose.grid.size[2]; ++k)
      for (std::size_t j = 0; j < dose.grid.size[1]; ++j)
        for (std::size_t i = 0; i < dose.grid.size[0]; ++i, ++n) {
          if (!(dose.values[n] >= settings.least_gy)) continue;
          const Vec3 p = position(n);
          if (std::ranges::none_of(
                  seeds, [&](const DoseSeed& seed) { return (seed.position - p).squaredNorm() < beside2; }))
            points_.push_back(n);
        }
  }

  const std::vector<std::size_t>& points() const { return points_; }  ///< voxels
  Vec3 position(std::size_t n) const {
    const auto& size = dose_.grid.size;
    return dose_.grid.position(Vec3(static_cast<double>(n % size[0]),
                                    static_cast<double>(n / size[0] % size[1]),
                                    static_cast<double>(n / size[0] / size[1])));
  }
  double file_gy(std::size_t n) const { return static_cast<double>(dose_.values[n]); }

  /// The recomputed dose at all voxels of the file's grid, moved.
  std::vector<float> recomputed(const std::vector<DoseSeed>& seeds, const Vec3& shift) const {
    VoxelGrid moved = dose_.grid;
    moved.origin += shift;
    return dose_at_voxels(seeds, moved);
  }

  DoseDifference difference(const std::vector<float>& recomputed) const {
    DoseDifference d;
    double sum = 0, squares = 0;
    for (const std::size_t n : points_) {
      const double percent = 100 * (static_cast<double>(recomputed[n]) / file_gy(n) - 1);
      sum += percent;
      squares += percent * percent;
      d.largest_percent = std::max(d.largest_percent, std::abs(percent));
    }
    d.points = points_.size();
    d.mean_percent = sum / static_cast<double>(d.points);
    d.rms_percent = std::sqrt(squares / static_cast<double>(d.points));
    return d;
  }

  /// Of some of the points, by exact sums: for one source of many.
  double rms_percent_of_few(const std::vector<DoseSeed>& seeds, const Vec3& shift) const {
    const std::vector<std::size_t> chosen = few();
    double squares = 0;
    for (const std::size_t n : chosen)
      squares += std::pow(100 * (total_dose_gy(seeds, position(n) + shift) / file_gy(n) - 1), 2);
    return std::sqrt(squares / static_cast<double>(chosen.size()));
  }

  /// Leaves the frames whose doses are others than those of most. Returns them, and the median of file / recomputed in
  /// the worst.
  std::vector<std::size_t> leave_wrong_frames(const std::vector<float>& recomputed, double& worst_ratio) {
    const std::size_t of_frame = dose_.grid.size[0] * dose_.grid.size[1];
    std::vector<std::vector<double>> ratios(dose_.grid.size[2]);
    std::vector<double> all;
    for (const std::size_t n : points_) {
      all.push_back(file_gy(n) / static_cast<double>(recomputed[n]));
      ratios[n / of_frame].push_back(all.back());
    }
    const double of_all = median(all);
    std::vector<std::size_t> wrong;
    for (std::size_t f = 0; f < ratios.size(); ++f) {
      if (ratios[f].size() < kLeastOfFrame) continue;
      const double ratio = median(ratios[f]) / of_all;
      if (std::abs(ratio - 1) <= kWrongFrame) continue;
      wrong.push_back(f);
      if (std::abs(ratio - 1) > std::abs(worst_ratio - 1)) worst_ratio = ratio;
    }
    // A third of the frames cannot be wrong: then it is the rest, or the source.
    if (3 * wrong.size() >= ratios.size()) wrong.clear();
    std::erase_if(points_,
                  [&](std::size_t n) { return std::ranges::find(wrong, n / of_frame) != wrong.end(); });
    return wrong;
  }

  /// By Gauss and Newton with Huber's weights, exact sums.
  Shift fit_shift(const std::vector<DoseSeed>& seeds) const {
    constexpr double kStepMm = 0.1, kFew = 0.02;
    Shift fit;
    double scale = 1;  // of the recomputed dose
    for (int turn = 0; turn < 10; ++turn) {
      Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
      Eigen::Vector4d right = Eigen::Vector4d::Zero();
      for (const std::size_t n : few()) {
        const Vec3 p = position(n) + fit.mm;
        const double relative = total_dose_gy(seeds, p) / file_gy(n), residual = scale * relative - 1;
        Eigen::Vector4d row;
        for (int a = 0; a < 3; ++a) {
          const Vec3 h = kStepMm * Vec3::Unit(a);
          row[a] = scale * (total_dose_gy(seeds, p + h) - total_dose_gy(seeds, p - h)) /
                   (2 * kStepMm * file_gy(n));
        }
        row[3] = relative;
        // Of a scale that is far off nothing is an outlier yet.
        const double weight = turn < 2 ? 1 : std::min(1.0, kFew / std::max(std::abs(residual), 1e-12));
        normal += weight * row * row.transpose();
        right -= weight * residual * row;
      }
      const Eigen::Vector4d change = normal.ldlt().solve(right);
      if (!change.allFinite()) break;
      fit.mm += change.head<3>().cwiseMax(-2).cwiseMin(2);
      scale = std::clamp(scale + change[3], 0.2 * scale, 5 * scale);
      if (turn > 2 && change.head<3>().norm() < 2e-3 && std::abs(change[3]) < 1e-5 * scale) break;
    }
    fit.scale = 1 / scale;
    return fit;
  }

  /// How far all dwells move towards their tips so that differences are least.
  double fit_along(const std::vector<DoseSeed>& all) const {
    constexpr double kStepMm = 0.1;
    double mm = 0;
    for (int turn = 0; turn < 6; ++turn) {
      const auto seeds = moved_along(all, mm), ahead = moved_along(all, mm + kStepMm),
                 behind = moved_along(all, mm - kStepMm);
      double normal = 0, right = 0;
      for (const std::size_t n : few()) {
        const Vec3 p = position(n);
        const double slope =
            (total_dose_gy(ahead, p) - total_dose_gy(behind, p)) / (2 * kStepMm * file_gy(n));
        normal += slope * slope;
        right -= slope * (total_dose_gy(seeds, p) / file_gy(n) - 1);
      }
      if (!(normal > 0)) return 0;
      const double change = std::clamp(right / normal, -2.0, 2.0);
      mm += change;
      if (std::abs(change) < 2e-3) break;
    }
    return mm;
  }

 private:
  std::vector<std::size_t> few() const {
    std::vector<std::size_t> chosen;
    const std::size_t step = std::max<std::size_t>(1, points_.size() / kFewPoints);
    for (std::size_t m = 0; m < points_.size(); m += step) chosen.push_back(points_[m]);
    return chosen;
  }

  const VoxelVolume& dose_;
  std::vector<std::size_t> points_;
};

/// The recomputed dose on a grid about the points and the structures.
DoseGrid grid_about(const std::vector<DoseSeed>& seeds, const Eigen::AlignedBox3d& box, double spacing_mm) {
  DoseGrid grid(box.min(), box.max(), spacing_mm);
  for (const DoseSeed& seed : seeds) grid.add(seed);
  return grid;
}

std::vector<GammaPass> gamma_of(const Comparison& comparison, const DoseGrid& recomputed, const Vec3& shift) {
  std::vector<GammaPass> all = {{3, 1, 0}, {2, 1, 0}};
  // Positions by their distance, so that the search ends where no nearer one can do better.
  const double step = recomputed.spacing_mm();
  constexpr double kFarthestMm = 3;
  std::vector<Vec3> around;
  const int reach = static_cast<int>(kFarthestMm / step);
  for (int k = -reach; k <= reach; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i)
        if (const Vec3 p = step * Vec3(i, j, k); p.norm() <= kFarthestMm) around.push_back(p);
  std::ranges::stable_sort(around, {}, [](const Vec3& p) { return p.squaredNorm(); });
  constexpr std::size_t kMost = 40'000;
  const std::vector<std::size_t>& points = comparison.points();
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kMost);
  std::size_t count = 0;
  std::vector<std::size_t> passed(all.size(), 0);
  for (std::size_t m = 0; m < points.size(); m += stride) {
    const Vec3 at = comparison.position(points[m]) + shift;
    const double file_gy = comparison.file_gy(points[m]);
    ++count;
    std::vector<bool> is_in(all.size(), false);
    for (const Vec3& offset : around) {
      const double dose = recomputed.at(at + offset);
      if (!std::isfinite(dose)) continue;
      bool is_done = true;
      for (std::size_t g = 0; g < all.size(); ++g) {
        const double difference = 100 * (dose / file_gy - 1) / all[g].percent;
        const double away2 = offset.squaredNorm() / (all[g].mm * all[g].mm);
        if (!is_in[g] && difference * difference + away2 <= 1) {
          is_in[g] = true;
          ++passed[g];
        }
        is_done &= is_in[g] || away2 > 1;
      }
      if (is_done) break;
    }
  }
  for (std::size_t g = 0; g < all.size(); ++g)
    all[g].pass_percent =
        100.0 * static_cast<double>(passed[g]) / static_cast<double>(std::max<std::size_t>(1, count));
  return all;
}

/// Between the file's voxels as between a DoseGrid's points: 1/√dose is linear in the distance from a source.
Volume roots_of(const VoxelVolume& dose) {
  std::vector<float> roots;
  for (const float gy : dose.values) roots.push_back(gy > 0 ? 1 / std::sqrt(gy) : 1e3F);
  return {dose.grid, std::move(roots)};
}

FiguresOfBoth compare_structure(const Structure& structure, const DoseGrid& recomputed, const Volume& roots,
                                double prescription_gy) {
  FiguresOfBoth both;
  both.name = structure.name;
  std::size_t outside = 0;
  for (const Vec3& v : structure.mesh.vertices) outside += !roots.contains(v);
  both.outside_percent =
      100.0 * static_cast<double>(outside) / static_cast<double>(structure.mesh.vertices.size());
  const StructureVoxels voxels = structure_voxels(SurfaceBvh(structure.mesh), recomputed);
  std::vector<DoseSample> file, own;
  const auto add = [&](const Vec3& p, double mm3) {
    if (!roots.contains(p)) return;
    const double root = static_cast<double>(roots.at(p)), dose = recomputed.at(p);
    if (!std::isfinite(dose)) return;
    file.push_back({1 / (root * root), mm3});
    own.push_back({dose, mm3});
    both.volume_cc += 1e-3 * mm3;
  };
  const double whole_mm3 = std::pow(recomputed.spacing_mm(), 3);
  const auto& size = recomputed.size();
  for (const std::uint32_t n : voxels.whole)
    add(recomputed.position(n % size[0], n / size[0] % size[1], n / size[0] / size[1]), whole_mm3);
  for (const StructureVoxels::Part& part : voxels.parts) add(part.centre, part.volume_mm3);
  both.file = structure_dose(structure.name, both.volume_cc, file, prescription_gy);
  both.recomputed = structure_dose(structure.name, both.volume_cc, own, prescription_gy);
  return both;
}

std::optional<double> days_between(const std::string& from, const std::string& to) {
  const auto day = [](const std::string& date) -> std::optional<double> {
    std::tm tm{};
    std::istringstream in(date);
    in >> std::get_time(&tm, "%Y%m%d");
    if (in.fail() || date.size() != 8) return std::nullopt;
    return static_cast<double>(timegm(&tm)) / 86400;
  };
  const auto a = day(from), b = day(to);
  return a && b ? std::optional(*b - *a) : std::nullopt;
}

void find_scale(DoseCheck& check, const HdrPlan& plan, const std::string& plan_date,
                const std::string& strength_date) {
  const double off = check.scale - 1;
  if (std::abs(off) < kNotedScale) return;
  std::string text = fmt::format("the file's dose is {:.4f} of the recomputed one", check.scale);
  const auto days = days_between(strength_date, plan_date);
  const double decay = days ? std::exp2(-*days / tg43_source(plan.source).half_life_days) : 1;
  constexpr double kLike = 0.005;
  if (days && std::abs(decay - 1) > kNotedScale && std::abs(check.scale / decay - 1) < kLike)
    text += fmt::format(": the decay of {:.0f} days, from the strength's date to the plan's, is in it twice",
                        *days);
  else if (days && std::abs(decay - 1) > kNotedScale && std::abs(check.scale * decay - 1) < kLike)
    text += fmt::format(
        ": as if the source had not decayed in {:.0f} days, though the times are for its strength "
        "after them",
        *days);
  else if (const double n = check.scale > 1 ? check.scale : 1 / check.scale;
           n > 1.5 && n < 40 && std::abs(n / std::round(n) - 1) < kLike)
    text +=
        fmt::format(": {} {:.0f} fractions or pulses", check.scale > 1 ? "it is of" : "the plan is of", n);
  else
    text += ": another strength, another source, or heterogeneities";
  check.findings.push_back(text);
}

void find_all(DoseCheck& check, const HdrPlan& plan, const VoxelVolume& dose, const std::string& plan_date,
              const std::string& strength_date) {
  const std::size_t frames = dose.grid.size[2];
  if (!check.wrong_frames.empty()) {
    const bool at_ends =
        std::ranges::all_of(check.wrong_frames, [&](std::size_t f) { return f < 3 || f + 3 >= frames; });
    std::string list;
    for (const std::size_t f : check.wrong_frames) list += (list.empty() ? "" : ", ") + std::to_string(f + 1);
    check.findings.push_back(
        fmt::format("{} are wrong: number {} (there are {}); the worst has {:.0f} % of the recomputed dose; "
                    "they count in no figure",
                    at_ends ? "end frames" : "frames", list, frames, 100 * check.wrong_frames_ratio));
  }
  if (check.shift_mm.norm() >= kNotedShiftMm && check.shifted.rms_percent < 0.8 * check.as_stored.rms_percent)
    check.findings.push_back(
        fmt::format("the doses agree best with the file's grid moved by {} (RAS): root mean square {:.2f} % "
                    "before, {:.2f} % "
                    "after; with the dwells moved {:+.2f} mm along their catheters instead {:.2f} %. Nothing "
                    "is corrected",
                    shift_text(check.shift_mm), check.as_stored.rms_percent, check.shifted.rms_percent,
                    check.along_mm, check.moved_along.rms_percent));
  find_scale(check, plan, plan_date, strength_date);
  const auto best = std::ranges::min_element(check.sources, {},
                                             [](const SourceFit& f) { return f.difference.rms_percent; });
  if (best->model != plan.source &&
      best->difference.rms_percent < 0.7 * check.sources.front().difference.rms_percent &&
      best->difference.rms_percent + 0.2 < check.sources.front().difference.rms_percent)
    check.findings.push_back(
        fmt::format("the dose fits {} better ({:.2f} %) than {} ({:.2f} %): another source table",
                    tg43_source(best->model).description, best->difference.rms_percent,
                    tg43_source(plan.source).description, check.sources.front().difference.rms_percent));
  for (const FiguresOfBoth& s : check.structures)
    if (s.outside_percent > kNotedOutsidePercent)
      check.findings.push_back(fmt::format(
          "the dose grid ends inside {}: {:.0f} % of its surface lies outside; its figures are of the rest",
          s.name, s.outside_percent));
  for (const DoseCheck::PointDose& p : check.plan_points)
    if (std::abs(p.recomputed_gy / p.file_gy - 1) > 0.01 * check.settings.tolerance_percent)
      check.findings.push_back(fmt::format("the plan states {:.3f} Gy at {}, recomputed {:.3f} Gy", p.file_gy,
                                           shift_text(p.position), p.recomputed_gy));
  if (std::max(check.as_stored.rms_percent, std::abs(check.as_stored.mean_percent)) >
          check.settings.tolerance_percent &&
      check.findings.empty())
    check.findings.push_back(fmt::format(
        "the doses differ by {:.2f} % (root mean square), and no shift, scale or source explains it",
        check.as_stored.rms_percent));
}

}  // namespace

void take_fitting_source(ImportedCase& imported) {
  if (!imported.plan || !imported.plan->has_assumed_source || !imported.dose) return;
  HdrPlan& plan = *imported.plan->hdr;
  const std::vector<DoseSeed> seeds = plan.seeds(imported.grid);
  Comparison comparison(*imported.dose, seeds, {});
  if (comparison.points().empty()) return;
  const Vec3 shift = comparison.fit_shift(seeds).mm;
  double ratio = 1;
  comparison.leave_wrong_frames(comparison.recomputed(seeds, shift), ratio);
  std::vector<std::pair<double, SourceModel>> fits;
  for (const SourceModel model : temporary_sources())
    fits.emplace_back(comparison.rms_percent_of_few(of_source(seeds, model), shift), model);
  std::ranges::stable_sort(fits, {}, &std::pair<double, SourceModel>::first);
  plan.source = fits.front().second;
  imported.plan->notes.front() = fmt::format(
      "the file does not name its Ir-192 source: taken to be {}, with which its dose agrees best ({:.2f} %, "
      "with {} "
      "{:.2f} %); --source takes another one of {}",
      tg43_source(plan.source).description, fits[0].first, tg43_source(fits[1].second).description,
      fits[1].first, source_names(false));
}

DoseCheck check_dose(const HdrPlan& plan, const TemplateGrid& grid, const std::vector<Structure>& structures,
                     const VoxelVolume& dose, const std::vector<RtPointDose>& points,
                     const std::string& plan_date, const std::string& strength_date,
                     const DoseCheckSettings& settings) {
  DoseCheck check;
  check.settings = settings;
  check.prescription_gy = plan.prescription_gy;
  const std::vector<DoseSeed> seeds = plan.seeds(grid);
  Comparison comparison(dose, seeds, settings);
  if (comparison.points().empty())
    throw UserError(
        fmt::format("no voxel of the dose has {:g} Gy and lies {:g} mm from every dwell; is it the plan's "
                    "dose, and in Gy? --least-gy and --beside-mm lower the bounds",
                    settings.least_gy, settings.beside_mm));
  check.wrong_frames = comparison.leave_wrong_frames(
      comparison.recomputed(seeds, comparison.fit_shift(seeds).mm), check.wrong_frames_ratio);
  const Shift shift = comparison.fit_shift(seeds);
  check.shift_mm = shift.mm;
  check.scale = shift.scale;
  const auto difference = [&](const std::vector<DoseSeed>& of, const Vec3& mm) {
    return comparison.difference(comparison.recomputed(of, mm));
  };
  check.as_stored = difference(seeds, Vec3::Zero());
  check.shifted = difference(seeds, check.shift_mm);
  check.along_mm = comparison.fit_along(seeds);
  check.moved_along = difference(moved_along(seeds, check.along_mm), Vec3::Zero());
  check.sources.push_back({plan.source, check.shifted});
  for (const SourceModel model : temporary_sources())
    if (model != plan.source)
      check.sources.push_back({model, difference(of_source(seeds, model), check.shift_mm)});
  Eigen::AlignedBox3d box;
  for (const std::size_t n : comparison.points()) box.extend(comparison.position(n));
  constexpr double kMarginMm = 4;
  box.min().array() -= kMarginMm;
  box.max().array() += kMarginMm;
  constexpr double kMostGammaPoints = 8e6;
  const double spacing = std::max(0.5, std::cbrt(box.volume() / kMostGammaPoints));
  const DoseGrid fine = grid_about(seeds, box, spacing);
  check.gamma = gamma_of(comparison, fine, Vec3::Zero());
  check.gamma_shifted = gamma_of(comparison, fine, check.shift_mm);
  const Volume roots = roots_of(dose);
  for (const Structure& structure : structures) {
    Eigen::AlignedBox3d of_structure;
    for (const Vec3& v : structure.mesh.vertices) of_structure.extend(v);
    of_structure.min().array() -= 2;
    of_structure.max().array() += 2;
    const double step = std::max(1.0, std::cbrt(of_structure.volume() / kMostGammaPoints));
    check.structures.push_back(
        compare_structure(structure, grid_about(seeds, of_structure, step), roots, plan.prescription_gy));
  }
  for (const RtPointDose& p : points)
    check.plan_points.push_back({p.position, p.gy, total_dose_gy(seeds, p.position)});
  find_all(check, plan, dose, plan_date, strength_date);
  return check;
}

}  // namespace brachy
