#include "apps/import/case/case_plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"

namespace brachy {
namespace {

constexpr double kSeed = PlanNeedle::kSeedMm, kSpacer = PlanNeedle::kSpacerMm;
constexpr double kBeforeTrainMm = 10;  // between template and train, more than trains grow by whole spacers

/// A train whose seeds lie nearest to these offsets behind the tip, and the distance of the worst one.
std::string train_of(const std::vector<double>& offsets, double& most_moved_mm) {
  std::string train;
  double end = 0;  // of the train so far
  for (const double offset : offsets) {
    const auto spacers = static_cast<int>(std::max(0L, std::lround((offset - 0.5 * kSeed - end) / kSpacer)));
    train.append(static_cast<std::size_t>(std::min(spacers, 60)), '-').append("s");
    end += spacers * kSpacer + kSeed;
    most_moved_mm = std::max(most_moved_mm, std::abs(end - 0.5 * kSeed - offset));
  }
  return train;
}

SourceModel source_of(const RtSource& source, const std::string& name) {
  for (const SourceModel model :
       {SourceModel::kAmersham6711, SourceModel::kTheraSeed200, SourceModel::kIsoRayCs1})
    if (source.model.find(to_string(model)) != std::string::npos) return model;
  // Without a known model the nuclide's.
  if (source.isotope.find("125") != std::string::npos) return SourceModel::kAmersham6711;
  if (source.isotope.find("103") != std::string::npos) return SourceModel::kTheraSeed200;
  if (source.isotope.find("131") != std::string::npos) return SourceModel::kIsoRayCs1;
  throw UserError(name + ": Source Sequence (300a,0210): no TG-43 data for model \"" +
                  one_short_line(source.model) + "\", isotope \"" + one_short_line(source.isotope) +
                  "\"; plan with I-125 (6711), Pd-103 (200) or Cs-131 (cs1-rev2)");
}

/// That of the channel; the first where its number is none's.
const RtSource& source_of(const RtBrachyPlan& file, const RtChannel& channel) {
  const auto found = std::ranges::find(file.sources, channel.source, &RtSource::number);
  return found == file.sources.end() ? file.sources.front() : *found;
}

/// Each dwell position once: there are two control points at it.
std::vector<RtControlPoint> positions_of(const RtChannel& channel) {
  std::vector<RtControlPoint> points;
  for (const RtControlPoint& point : channel.points)
    if (points.empty() || (points.back().position - point.position).norm() > 1e-6) points.push_back(point);
  return points;
}

/// A needle as the file has it: its sources from the tip backwards.
struct FileNeedle {
  Vec3 tip;
  std::vector<double> offsets;
  const RtChannel* channel;
};

FileNeedle needle_of(const RtChannel& channel, const std::string& name) {
  std::vector<RtControlPoint> points = positions_of(channel);
  std::ranges::stable_sort(points, std::greater<>(), [](const RtControlPoint& p) { return p.position.z(); });
  const RtControlPoint& first = points.front();
  for (const RtControlPoint& p : points)
    if ((p.position - first.position).head<2>().norm() >
        0.05 * std::abs(p.position.z() - first.position.z()) + 0.2)
      throw NoTemplatePlan(
          name + ": Control Point Sequence (300a,02d0): channel " + std::to_string(channel.number) +
          " does not run along the patient's axis; plan straight needles through a template");
  FileNeedle needle{
      first.position + Vec3(0, 0, first.relative_mm > 0 ? first.relative_mm : 0.5 * kSeed), {}, &channel};
  for (const RtControlPoint& p : points) needle.offsets.push_back(needle.tip.z() - p.position.z());
  return needle;
}

/// Single seeds of an application setup each, in one line, are one needle.
std::vector<FileNeedle> needles_of(const RtBrachyPlan& file, const std::string& name) {
  std::vector<FileNeedle> needles;
  for (const RtChannel& channel : file.channels) {
    FileNeedle needle = needle_of(channel, name);
    const auto same = std::ranges::find_if(needles, [&](const FileNeedle& other) {
      return (other.tip - needle.tip).head<2>().norm() < 0.2 &&
             other.offsets.size() + needle.offsets.size() < 60;
    });
    if (same == needles.end()) {
      needles.push_back(std::move(needle));
      continue;
    }
    std::vector<double> heights;
    for (const auto* of : {&*same, &needle})
      for (const double offset : of->offsets) heights.push_back(of->tip.z() - offset);
    same->tip.z() = std::max(same->tip.z(), needle.tip.z());
    std::ranges::sort(heights, std::greater<>());
    same->offsets.clear();
    for (const double z : heights) same->offsets.push_back(same->tip.z() - z);
  }
  return needles;
}

}  // namespace

TemplateGrid template_before(const Vec3& min_mm, const Vec3& max_mm) {
  TemplateGrid grid;
  const Vec3 middle = 0.5 * (min_mm + max_mm);
  const auto tenths = [](double v) { return std::round(10 * v) / 10; };
  grid.origin_mm = {tenths(middle.x()) - 30, tenths(middle.y()) - 30, tenths(min_mm.z()) - 37.5};
  grid.letters_from = "right";  // as clinics have it
  return grid;
}

// Behind a description: "A1" in it is the hole of the least x and y, by whatever name.
constexpr const char *kFromRight = ", letters from the right", *kHalfSteps = ", half steps";

std::string template_text(const TemplateGrid& grid, double base_plane_mm) {
  return "brachyd template " + std::to_string(grid.columns) + " x " + std::to_string(grid.rows) + ", pitch " +
         exact_text(grid.spacing_mm) + " mm, A1 at " + exact_text(grid.origin_mm.x()) + " " +
         exact_text(grid.origin_mm.y()) + " " + exact_text(grid.origin_mm.z()) + " mm RAS, base plane " +
         exact_text(base_plane_mm) + " mm" + (grid.letters_from == "right" ? kFromRight : "") +
         (grid.half_steps ? kHalfSteps : "");
}

std::optional<DescribedTemplate> parse_template_text(const std::string& text) {
  DescribedTemplate t{};
  double x = 0, y = 0, z = 0;
  if (std::sscanf(text.c_str(),
                  "brachyd template %d x %d, pitch %lf mm, A1 at %lf %lf %lf mm RAS, base plane %lf mm",
                  &t.grid.columns, &t.grid.rows, &t.grid.spacing_mm, &x, &y, &z, &t.base_plane_mm) != 7)
    return std::nullopt;
  t.grid.origin_mm = {x, y, z};
  if (text.find(kFromRight) != std::string::npos) t.grid.letters_from = "right";
  t.grid.half_steps = text.find(kHalfSteps) != std::string::npos;
  const bool is_sound = t.grid.columns >= 1 && t.grid.columns <= TemplateGrid::kMaxColumns &&
                        t.grid.rows >= 1 && t.grid.rows <= TemplateGrid::kMaxRows && t.grid.spacing_mm >= 1 &&
                        t.grid.spacing_mm <= 50 && t.grid.origin_mm.allFinite() &&
                        t.grid.origin_mm.cwiseAbs().maxCoeff() <= 1e5 && t.base_plane_mm >= 1 &&
                        t.base_plane_mm <= 500;
  return is_sound ? std::optional(t) : std::nullopt;
}

CasePlan fit_plan(const RtBrachyPlan& file, const TemplateGrid& proposed, const std::string& name) {
  CasePlan result;
  result.grid = proposed;
  const std::vector<FileNeedle> needles = needles_of(file, name);
  const auto described = parse_template_text(file.description);
  if (described) {
    result.grid = described->grid;
  } else {
    // Holes through the first needle, as near to the proposed ones as the pitch allows.
    const Vec3 off = needles.front().tip - result.grid.origin_mm;
    for (int a = 0; a < 2; ++a) result.grid.origin_mm[a] += off[a] - 5 * std::round(off[a] / 5);
  }
  Plan& plan = result.plan;
  plan.name = "imported";
  const RtSource& used = source_of(file, file.channels.front());
  plan.source = source_of(used, name);
  plan.air_kerma_strength_u = used.air_kerma_strength_u;
  for (const RtChannel& channel : file.channels)
    for (const RtSource& other : file.sources)
      if (other.number == channel.source && other.air_kerma_strength_u != used.air_kerma_strength_u)
        throw NoTemplatePlan(
            name + ": Source Sequence (300a,0210): seeds of different strengths; plan with one strength");
  if (file.prescription_gy) plan.prescription_gy = *file.prescription_gy;
  // The needles hold their trains when they stand in the template.
  if (!described)
    for (const FileNeedle& needle : needles)
      result.grid.origin_mm.z() =
          std::min(result.grid.origin_mm.z(),
                   std::floor(needle.tip.z() - needle.offsets.back() - kSeed - kBeforeTrainMm));
  double deepest = 0;
  for (const FileNeedle& needle : needles)
    deepest = std::max(deepest, needle.tip.z() - result.grid.origin_mm.z());
  plan.base_plane_mm = described ? described->base_plane_mm : deepest;
  double most_beside = 0;
  for (const FileNeedle& needle : needles) {
    const auto hole = result.grid.nearest(needle.tip, Vec3::UnitZ());
    if (!hole)
      throw NoTemplatePlan(
          name + ": Control Point 3D Position (300a,02d4): channel " +
          std::to_string(needle.channel->number) +
          " lies beside a template of 13 × 13 holes about the gland; is it this patient's plan?");
    most_beside = std::max(most_beside, (*result.grid.position(*hole) - needle.tip).head<2>().norm());
    // To a nanometre: what decimal strings carry.
    const double retraction =
        std::round(1e6 * (plan.base_plane_mm - (needle.tip.z() - result.grid.origin_mm.z()))) / 1e6;
    plan.needles.push_back(
        {*hole, retraction == 0 ? 0.0 : retraction, train_of(needle.offsets, result.most_moved_mm)});
  }
  if (most_beside > kMostBesideMm)
    throw NoTemplatePlan(name + ": Control Point 3D Position (300a,02d4): needles lie up to " +
                         text_of(most_beside) + " mm beside the holes of a template 5 mm apart");
  result.most_moved_mm = std::hypot(result.most_moved_mm, most_beside);
  if (result.most_moved_mm > 1e-3)
    result.notes.push_back("seeds were moved by up to " + text_of(result.most_moved_mm) +
                           " mm onto the template's holes and whole spacers");
  return result;
}

std::vector<DoseSeed> seeds_of(const RtBrachyPlan& file, const std::string& name) {
  std::vector<DoseSeed> seeds;
  for (const RtChannel& channel : file.channels) {
    const RtSource& source = source_of(file, channel);
    const SourceModel model = source_of(source, name);
    const std::vector<RtControlPoint> points = positions_of(channel);
    const Vec3 along = points.back().position - points.front().position;
    const Vec3 of_channel = along.norm() > 0 ? along.normalized() : Vec3(Vec3::UnitZ());
    for (const RtControlPoint& point : points)
      seeds.push_back({point.position, point.axis.value_or(of_channel), model, source.air_kerma_strength_u});
  }
  return seeds;
}

std::string hdr_text(const HdrPlan& plan) {
  return ", dwells every " + exact_text(plan.step_mm) + " mm from " + exact_text(plan.tip_offset_mm) +
         " mm behind the tip";
}

CasePlan fit_hdr_plan(const RtBrachyPlan& file, const std::string& name) {
  const auto described = parse_template_text(file.description);
  const auto at = file.description.find(", dwells every ");
  CasePlan result;
  HdrPlan& plan = result.hdr.emplace();
  if (!described || at == std::string::npos ||
      std::sscanf(file.description.c_str() + at, ", dwells every %lf mm from %lf mm behind the tip",
                  &plan.step_mm, &plan.tip_offset_mm) != 2 ||
      !(plan.step_mm >= 0.1 && plan.tip_offset_mm >= 0))
    throw UserError(name +
                    ": RT Plan Description (300a,0004): does not name the template of an HDR plan of `brachy "
                    "export --dicom`; other systems' HDR plans are not read");
  result.grid = described->grid;
  plan.name = "imported";
  plan.source_strength_u = file.sources.front().air_kerma_strength_u;
  if (file.prescription_gy) plan.prescription_gy = *file.prescription_gy;
  // Decimal strings of 16 characters carry a nanometre and a nanosecond.
  const auto rounded = [](double value) { return std::round(1e9 * value) / 1e9; };
  for (const RtChannel& channel : file.channels) {
    const Vec3 tip = channel.points.front().position + Vec3(0, 0, channel.points.front().relative_mm);
    const auto hole = result.grid.nearest(tip, Vec3::UnitZ());
    if (!hole || (result.grid.position(*hole)->head<2>() - tip.head<2>()).norm() > 0.01)
      throw UserError(name + ": Control Point 3D Position (300a,02d4): channel " +
                      std::to_string(channel.number) + " lies beside the template's holes; export it again");
    PlanCatheter catheter{*hole, std::round(1e6 * (tip.z() - result.grid.origin_mm.z())) / 1e6, {}};
    const double all = channel.points.back().time_weight;
    const double seconds = all > 0 && channel.total_time_s > 0 ? channel.total_time_s / all : 1;
    for (std::size_t p = 0; p + 1 < channel.points.size(); p += 2) {
      const double index = std::round((channel.points[p].relative_mm - plan.tip_offset_mm) / plan.step_mm);
      if (!(index >= 0 && index < 60))
        throw UserError(name + ": Control Point Relative Position (300a,02d2): channel " +
                        std::to_string(channel.number) +
                        " has a dwell that is none of its steps; export it again");
      const auto dwell = static_cast<std::size_t>(index);
      if (catheter.dwell_s.size() <= dwell) catheter.dwell_s.resize(dwell + 1, 0.0);
      catheter.dwell_s[dwell] +=
          rounded(seconds * (channel.points[p + 1].time_weight - channel.points[p].time_weight));
    }
    plan.catheters.push_back(std::move(catheter));
  }
  return result;
}

}  // namespace brachy
