#include "apps/import/case/case_catheters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "apps/import/case/case_structures.h"
#include "apps/import/dicom/dicom_tags.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/one_line.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/needle/contact_settings.h"

namespace brachy {
namespace {

constexpr double kFarthestStructureMm = 10;  // of a dwell beside the structure that is its catheter
constexpr double kShortestCatheterMm = 20;   // of a structure that no channel names
constexpr double kBeyondMm = 0.5;  // a point of the structure this far beyond the last dwell goes on from it

/// Words of model and maker that name a source of which there are data.
struct KnownSource {
  const char* words;  ///< all of them, in lower case, with a blank between
  SourceModel model;
};
constexpr KnownSource kKnownSources[] = {
    {"mhdr", SourceModel::kMicroSelectronV2},
    {"microselectron", SourceModel::kMicroSelectronV2},
    {"micro selectron", SourceModel::kMicroSelectronV2},
    {"flexi", SourceModel::kFlexisource},
    {"gammamed pdr", SourceModel::kGammaMedPlusPdr},
    {"gammamed", SourceModel::kGammaMedPlusHdr},
    {"gm11010080", SourceModel::kGammaMedPlusHdr},
    {"vs2000", SourceModel::kVs2000},
    {"vs 2000", SourceModel::kVs2000},
    {"varisource classic", SourceModel::kVariSourceClassic},
    {"m-19", SourceModel::kSpecM19},
    {"m19", SourceModel::kSpecM19},
    {"105.002", SourceModel::kMicroSelectronV2},
};

bool has_all(const std::string& text, const std::string& words) {
  std::size_t at = 0;
  while (at < words.size()) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    if (text.find(words.substr(at, end - at)) == std::string::npos) return false;
    at = end + 1;
  }
  return true;
}

bool is_iridium(const RtSource& source) {
  if (source.isotope.find("192") != std::string::npos) return true;
  // Placeholders occur: then its half-life tells, 73.8 days.
  return source.isotope.find_first_of("0123456789") == std::string::npos && source.half_life_days > 73 &&
         source.half_life_days < 75;
}

double distance_to(const std::vector<Vec3>& course, const Vec3& p) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < course.size(); ++i) {
    const Vec3 along = course[i + 1] - course[i];
    const double length2 = along.squaredNorm();
    const double t = length2 > 0 ? std::clamp((p - course[i]).dot(along) / length2, 0.0, 1.0) : 0;
    least = std::min(least, (p - course[i] - t * along).norm());
  }
  return least;
}

double largest_distance(const ImportedCourse& course, const std::vector<RtDwell>& dwells) {
  double most = 0;
  for (const RtDwell& dwell : dwells) most = std::max(most, distance_to(course.points, dwell.position));
  return most;
}

double length_of(const std::vector<Vec3>& course) {
  double length = 0;
  for (std::size_t i = 1; i < course.size(); ++i) length += (course[i] - course[i - 1]).norm();
  return length;
}

/// The structure that is this channel's catheter, taken out of the list; nothing where none lies there.
std::optional<ImportedCourse> take_course(const RtChannel& channel, const std::vector<RtDwell>& dwells,
                                          std::vector<ImportedCourse>& courses) {
  const auto named = std::ranges::find_if(
      courses, [&](const ImportedCourse& c) { return channel.roi && c.roi == *channel.roi; });
  auto best = named;
  if (named == courses.end() || largest_distance(*named, dwells) > kFarthestStructureMm)
    best = std::ranges::min_element(courses, {}, [&](const ImportedCourse& c) {
      return length_of(c.points) < kShortestCatheterMm ? std::numeric_limits<double>::infinity()
                                                       : largest_distance(c, dwells);
    });
  if (best == courses.end() || largest_distance(*best, dwells) > kFarthestStructureMm ||
      (best != named && length_of(best->points) < kShortestCatheterMm))
    return std::nullopt;
  ImportedCourse course = std::move(*best);
  courses.erase(best);
  return course;
}

/// Dwells from the tip backwards. Returns whether relative positions count the other way.
bool sort_from_tip(std::vector<RtDwell>& dwells) {
  // Along the catheter they are in order already, one way or the other.
  const Vec3 way = dwells.back().position - dwells.front().position;
  const double relative = dwells.back().relative_mm - dwells.front().relative_mm;
  const bool is_along_patient = std::abs(way.z()) > 0.5 * way.norm();
  const bool is_backwards = is_along_patient ? way.z() > 0 : relative < 0;
  if (is_backwards) std::ranges::reverse(dwells);
  return is_along_patient && relative != 0 && (relative > 0) == is_backwards;
}

/// The points of a structure beyond an end of the dwells, outwards: those that lie ahead of `end` in the direction
/// `outwards`, nearest first.
std::vector<Vec3> points_beyond(const std::vector<Vec3>& points, const Vec3& end, const Vec3& outwards) {
  std::vector<Vec3> beyond;
  for (const Vec3& p : points)
    if ((p - end).dot(outwards) > kBeyondMm) beyond.push_back(p);
  std::ranges::sort(beyond, {}, [&](const Vec3& p) { return (p - end).dot(outwards); });
  return beyond;
}

PlanCatheter catheter_along(const std::vector<RtDwell>& dwells,
                            const std::optional<ImportedCourse>& structure) {
  constexpr double kEndMm = 5;  // of a catheter of which nothing but the dwells is known
  PlanCatheter catheter;
  std::vector<Vec3>& course = catheter.course;
  for (const RtDwell& dwell : dwells)
    if (course.empty() || (course.back() - dwell.position).norm() > 1e-3) course.push_back(dwell.position);
  const Vec3 out = course.size() > 1 ? Vec3((course[0] - course[1]).normalized()) : Vec3(Vec3::UnitZ());
  const Vec3 in =
      course.size() > 1 ? Vec3((course.back() - course.end()[-2]).normalized()) : Vec3(-Vec3::UnitZ());
  std::vector<Vec3> tip, entry;
  if (structure) {
    tip = points_beyond(structure->points, course.front(), out);
    entry = points_beyond(structure->points, course.back(), in);
  }
  if (tip.empty()) tip.push_back(course.front() + kEndMm * out);
  if (entry.empty()) entry.push_back(course.back() + kEndMm * in);
  std::ranges::reverse(tip);
  course.insert(course.begin(), tip.begin(), tip.end());
  course.insert(course.end(), entry.begin(), entry.end());
  // Along the course each dwell is one of its points.
  std::size_t at = tip.size() - 1;
  double along = 0;
  for (std::size_t i = 1; i <= at; ++i) along += (course[i] - course[i - 1]).norm();
  for (const RtDwell& dwell : dwells) {
    if (at + 1 < course.size() && (course[at] - dwell.position).norm() > 1e-3) {
      along += (course[at + 1] - course[at]).norm();
      ++at;
    }
    catheter.dwell_mm.push_back(along);
    catheter.dwell_s.push_back(dwell.seconds);
  }
  return catheter;
}

/// Cuts what stands out of the patient off a course that is longer than a needle.
void cut_to_needle(PlanCatheter& catheter, const std::string& name) {
  const double most = NeedleSettings().length_mm;
  if (catheter.dwell_mm.back() > most)
    throw UserError(name + ": Control Point Sequence (300a,02d0): catheter " + catheter.name +
                    " has a dwell " + text_of(catheter.dwell_mm.back()) +
                    " mm behind its tip, and a needle is " + text_of(most) +
                    " mm long; is it this plan's structure?");
  double along = 0;
  for (std::size_t i = 1; i < catheter.course.size(); ++i) {
    const Vec3 step = catheter.course[i] - catheter.course[i - 1];
    if (along + step.norm() > most) {
      // The last dwell stays on the course, whatever rounding does.
      const double left = std::max(most - along, catheter.dwell_mm.back() - along);
      catheter.course[i] = catheter.course[i - 1] + left / step.norm() * step;
      catheter.course.resize(left > 1e-3 ? i + 1 : i);
      return;
    }
    along += step.norm();
  }
}

std::string catheter_name(const RtChannel& channel, const std::optional<ImportedCourse>& structure) {
  std::string name = one_short_line(channel.applicator);
  if (name.empty() && structure) name = one_short_line(structure->name);
  return plain_name(name, "channel_" + std::to_string(channel.number));
}

void check_kerma(const RtBrachyPlan& file, const HdrPlan& plan, std::vector<std::string>& notes) {
  const double kerma = plan.source_strength_u * plan.total_s() / 3600;
  constexpr double kMostOff = 1e-3;
  if (!file.total_air_kerma_ugy || std::abs(*file.total_air_kerma_ugy / kerma - 1) <= kMostOff) return;
  notes.push_back(fmt::format(
      "Total Reference Air Kerma (300a,0250) is {:g} µGy and strength times time {:g}: one of them is of "
      "another strength, fraction or number of pulses",
      *file.total_air_kerma_ugy, kerma));
}

}  // namespace

TemporarySource temporary_source_of(const RtSource& source, const std::string& wanted,
                                    const std::string& name) {
  if (!wanted.empty()) {
    const auto model = find_source(wanted);
    if (!model || tg43_source(*model).is_permanent)
      throw UserError("--source " + one_short_line(wanted) + ": there are " + source_names(false));
    return {*model, false};
  }
  if (const auto own = find_source(source.model); own && !tg43_source(*own).is_permanent)
    return {*own, false};
  if (!is_iridium(source))
    throw UserError(name + ": Source Sequence (300a,0210): no TG-43 data for model \"" +
                    one_short_line(source.model) + "\", isotope \"" + one_short_line(source.isotope) +
                    "\"; --source takes one of " + source_names(false));
  const std::string text = lower_case(source.maker + " " + source.model + " " + source.isotope);
  for (const KnownSource& known : kKnownSources)
    if (has_all(text, known.words)) return {known.model, false};
  if (source.active_length_mm > 8) return {SourceModel::kVariSourceClassic, true};
  if (source.active_length_mm > 4.5) return {SourceModel::kVs2000, true};
  if (source.active_length_mm > 0 && source.active_length_mm < 2)
    return {SourceModel::kGammaMedPlusPdr, true};
  return {SourceModel::kMicroSelectronV2, true};
}

CasePlan catheters_of(const RtBrachyPlan& file, std::vector<ImportedCourse>& courses,
                      const std::string& wanted, const std::string& name) {
  CasePlan result;
  HdrPlan& plan = result.hdr.emplace();
  plan.name = "imported";
  const auto used = std::ranges::find(file.sources, file.channels.front().source, &RtSource::number);
  const RtSource& source = used == file.sources.end() ? file.sources.front() : *used;
  for (const RtChannel& channel : file.channels)
    if (channel.source != file.channels.front().source)
      throw UserError(name +
                      ": Referenced Source Number (300c,000e): channels have different sources; export a "
                      "plan of one source");
  const TemporarySource known = temporary_source_of(source, wanted, name);
  plan.source = known.model;
  result.has_assumed_source = known.is_assumed;
  if (known.is_assumed)
    result.notes.push_back(
        fmt::format("the file does not name its Ir-192 source (maker \"{}\", model \"{}\", active length "
                    "{:g} mm): taken to be {}; "
                    "--source takes another one of {}",
                    one_short_line(source.maker), one_short_line(source.model), source.active_length_mm,
                    tg43_source(plan.source).description, source_names(false)));
  plan.source_strength_u = source.air_kerma_strength_u;
  if (file.prescription_gy) plan.prescription_gy = *file.prescription_gy;
  double most_beside = 0;
  std::size_t turned = 0, without = 0;
  for (const RtChannel& channel : file.channels) {
    std::vector<RtDwell> dwells = dwells_of(channel, name);
    if (std::ranges::all_of(dwells, [](const RtDwell& d) { return d.seconds == 0; })) {
      result.notes.push_back("channel " + std::to_string(channel.number) + " has no dwell: left");
      continue;
    }
    turned += sort_from_tip(dwells);
    const std::optional<ImportedCourse> structure = take_course(channel, dwells, courses);
    if (structure)
      most_beside = std::max(most_beside, largest_distance(*structure, dwells));
    else
      ++without;
    PlanCatheter catheter = catheter_along(dwells, structure);
    catheter.name = catheter_name(channel, structure);
    cut_to_needle(catheter, name);
    const auto is_taken = [&](const std::string& called) {
      return std::ranges::any_of(plan.catheters, [&](const PlanCatheter& c) { return c.name == called; });
    };
    if (is_taken(catheter.name)) catheter.name += "_" + std::to_string(channel.number);
    plan.catheters.push_back(std::move(catheter));
  }
  if (plan.dwell_count() == 0)
    throw UserError(name +
                    ": Control Point Sequence (300a,02d0): no channel has a dwell with a time; export the "
                    "plan with its times");
  if (most_beside > 0)
    result.notes.push_back(fmt::format(
        "dwells lie up to {:.2f} mm beside the straight pieces of the structures that are their catheters",
        most_beside));
  if (without > 0)
    result.notes.push_back(std::to_string(without) +
                           " catheters have no structure: they go on straight beyond their dwells" +
                           (file.private_data.empty() ? ""
                                                      : "; private data of the plan, " + file.private_data +
                                                            ", may have their courses and is not read"));
  if (turned > 0)
    result.notes.push_back(
        std::to_string(turned) +
        " catheters count relative positions from their other end; the deeper end is the tip");
  check_kerma(file, plan, result.notes);
  try {
    (void)parse_hdr_plan(to_toml(plan, TemplateGrid()), "plan", TemplateGrid(), NeedleSettings().length_mm);
  } catch (const UserError& e) {
    throw UserError(name +
                    ": Application Setup Sequence (300a,0230): is beyond what a plan may have: " + e.what());
  }
  return result;
}

}  // namespace brachy
