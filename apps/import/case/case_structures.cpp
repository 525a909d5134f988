#include "apps/import/case/case_structures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>

#include "apps/import/case/case_roles.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/structures/name_words.h"
#include "core/geometry/contours/contour_surface.h"
#include "core/geometry/label_map/label_surface.h"
#include "core/geometry/simplify/simplify.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/surface/surface_volume.h"

namespace brachy {
namespace {

constexpr double kNotedMm = 0.05;  // decimal strings are rounded

bool is_label(const ImportedStructure& s) {
  return s.from.starts_with("label");
}

/// Where a structure lies.
struct Place {
  Vec3 middle = Vec3::Zero();  // of its vertices
  Eigen::AlignedBox3d box;
};

Place place_of(const ImportedStructure& s) {
  Place place;
  for (const Vec3& v : s.mesh.vertices) {
    place.middle += v / static_cast<double>(s.mesh.vertices.size());
    place.box.extend(v);
  }
  return place;
}

/// Whether two of one name are one structure, as an RTSTRUCT has it and the label map that was exported with it.
/// Between contours and labels is a voxel's width.
bool is_again(const ImportedStructure& a, const Place& at_a, const ImportedStructure& b, const Place& at_b) {
  const std::string words = joined_words(name_words(a.file_name.empty() ? a.name : a.file_name));
  if (words.empty() || words != joined_words(name_words(b.file_name.empty() ? b.name : b.file_name)) ||
      !a.fault.empty() || !b.fault.empty() || at_a.box.isEmpty() || at_b.box.isEmpty())
    return false;
  const bool is_of_both = is_label(a) != is_label(b);
  const double most_cc = is_of_both ? 0.1 * b.surface_cc + 0.2 : 0.05 * b.surface_cc;
  return std::abs(a.surface_cc - b.surface_cc) <= most_cc &&
         (at_a.middle - at_b.middle).norm() <= (is_of_both ? 2 : 1) &&
         (at_a.box.min() - at_b.box.min()).norm() + (at_a.box.max() - at_b.box.max()).norm() <= 6;
}

}  // namespace

std::string CaseStructures::unique(const std::string& name) const {
  const auto is_used = [&](const std::string& n) {
    return std::ranges::any_of(imported_.structures, [&](const auto& s) { return s.name == n; });
  };
  if (!is_used(name)) return name;
  for (int n = 2;; ++n)
    if (const std::string next = name.substr(0, 28) + "_" + std::to_string(n); !is_used(next)) return next;
}

void CaseStructures::add(ImportedStructure structure, const std::string& file) {
  SimplifyOptions simpler{options_.tolerance_mm, 200};
  SurfaceMesh mesh = simplify(structure.mesh, simpler);
  while (mesh.vertices.size() > options_.most_vertices && simpler.tolerance_mm < 1) {
    simpler.tolerance_mm *= 1.5;
    mesh = simplify(mesh, simpler);
  }
  if (simpler.tolerance_mm > options_.tolerance_mm)
    structure.notes.push_back("simplified to " + text_of(simpler.tolerance_mm) + " mm");
  PreparedSurface prepared = prepare_surface(mesh, {1e-4, 0.001}, file);
  require_closed(prepared.report, file + ": structure " + structure.name);
  if (prepared.report.dropped_islands > 0)
    structure.notes.push_back("left " + std::to_string(prepared.report.dropped_islands) + " islands, " +
                              text_of(prepared.report.dropped_island_volume_cc) + " cc");
  structure.mesh = std::move(prepared.mesh);
  structure.surface_cc = prepared.report.volume_cc;
  const double expected = structure.source_cc - prepared.report.dropped_island_volume_cc;
  if (std::abs(structure.surface_cc - expected) > 0.01 * structure.source_cc)
    structure.notes.push_back("volume " + text_of(structure.surface_cc) + " cc for " +
                              text_of(structure.source_cc) + " cc in the file");
  structure.name = unique(structure.name);
  imported_.structures.push_back(std::move(structure));
}

bool CaseStructures::is_wanted(const std::string& file_name, const std::string& name,
                               const std::string& place) {
  seen_.insert(file_name);
  seen_.insert(name);
  const auto has = [&](const std::vector<std::string>& list) {
    return std::ranges::any_of(list, [&](const std::string& n) { return n == file_name || n == name; });
  };
  if (has(options_.leave))
    imported_.left.push_back(place + ": " + name + ": by --leave");
  else if (!options_.only.empty() && !has(options_.only))
    imported_.left.push_back(place + ": " + name + ": is not named by --only");
  else
    return true;
  return false;
}

void CaseStructures::read_contours(const RtRoi& roi, const std::string& file, const ImageSlices& images,
                                   ImportedStructure& structure) {
  const std::string where = file + ": Contour Data (3006,0050): " + structure.from;
  const ContourStack stack = stack_contours(roi.contours, where, images);
  if (stack.missing_planes > 0)
    structure.notes.push_back(std::to_string(stack.missing_planes) + " missing slices were interpolated");
  if (stack.repeated > 0)
    structure.notes.push_back(std::to_string(stack.repeated) + " contours occurred twice");
  if (stack.most_apart_mm > kNotedMm)
    structure.notes.push_back(
        fmt::format("contours of one slice lie up to {:.2f} mm apart", stack.most_apart_mm));
  if (stack.most_moved_mm > kNotedMm)
    structure.notes.push_back(
        fmt::format("contours lie up to {:.2f} mm beside evenly spaced slices, and are taken to be on these",
                    stack.most_moved_mm));
  if (stack.crossing_planes > 0)
    structure.notes.push_back("contours cross in " + std::to_string(stack.crossing_planes) +
                              " planes: what lies in two of them is taken to be outside");
  ContourSurface surface = contour_surface(stack, where);
  structure.mesh = std::move(surface.mesh);
  structure.source_cc = stack.crossing_planes > 0 ? surface.surface_cc : surface.slabs_cc;
}

void CaseStructures::add_rois(const RtStructureSet& set, const std::string& file, std::size_t number,
                              const std::string& place, const ImageSlices& images) {
  for (const std::string& what : set.left) imported_.left.push_back(place + ": " + what);
  for (const RtRoi& roi : set.rois) {
    const std::string from = "ROI " + std::to_string(roi.number);
    ImportedStructure structure;
    structure.name = plain_name(roi.name, "roi_" + std::to_string(roi.number));
    structure.file_name = roi.name;
    structure.from = from;
    structure.colour = roi.colour;
    structure.notes = roi.notes;
    structure.fault = roi.fault;
    structure.file = number;
    if (!is_wanted(roi.name, structure.name, place + ": " + from)) continue;
    progress_(structure.name);
    const std::string what = place + ": " + from + ": " + structure.name + ": ";
    const std::string others = roi.other_contours == 0 ? ""
                               : roi.other_contours == 1
                                   ? "a point or open contour"
                                   : std::to_string(roi.other_contours) + " points or open contours";
    if (structure.fault.empty() && !has_area(roi.contours)) {
      const std::string left =
          what + "has no closed contour with an area" + (others.empty() ? "" : ", but " + others);
      if (roi.course.size() >= 2)
        imported_.courses.push_back({roi.number, roi.name, roi.course, left});
      else
        imported_.left.push_back(left);
      continue;
    }
    if (!others.empty()) imported_.left.push_back(what + others);
    ImportedStructure unread = structure;
    try {
      if (!structure.fault.empty()) throw UserError(structure.fault);
      read_contours(roi, file, images, structure);
      add(std::move(structure), file);
    } catch (const UserError& e) {
      unread.fault = e.what();
      unread.name = unique(unread.name);
      imported_.structures.push_back(std::move(unread));
    }
  }
}

void CaseStructures::add_segments(const LabelMap& map, const std::string& file, std::size_t number,
                                  const std::string& place) {
  imported_.left.insert(imported_.left.end(), map.notes.begin(), map.notes.end());
  if (map.segments.empty()) imported_.left.emplace_back("a label map without a label");
  for (const LabelMap::Segment& segment : map.segments) {
    const std::string from = "label " + std::to_string(segment.value) +
                             (map.layers.size() > 1 ? " of layer " + std::to_string(segment.layer) : "");
    std::string called = segment.name;
    if (called.empty() && map.segments.size() == 1) called = organ_in_file_name(file);
    const std::string name = plain_name(called, "label_" + std::to_string(segment.value));
    if (!is_wanted(called, name, place + ": " + from)) continue;
    progress_(name);
    const auto& labels = map.layers[segment.layer];
    if (std::ranges::find(labels, segment.value) == labels.end()) {
      imported_.left.push_back(from + ": no voxel has it");
      continue;
    }
    LabelSurface surface = label_surface(map.grid, labels, segment.value);
    ImportedStructure structure;
    structure.name = name;
    structure.file_name = called;
    structure.from = from;
    structure.colour = segment.colour;
    structure.mesh = std::move(surface.mesh);
    structure.source_cc = surface.voxels_cc;
    structure.file = number;
    add(std::move(structure), file);
  }
}

void CaseStructures::leave_repeated() {
  for (const auto* names : {&options_.leave, &options_.only})
    for (const std::string& name : *names)
      if (!seen_.contains(name)) {
        std::string all;
        for (const std::string& seen : seen_)
          if (!seen.empty()) all.append(all.empty() ? "" : ", ").append(seen);
        throw UserError((names == &options_.leave ? "--leave " : "--only ") + name +
                        ": no file has a structure of that name; there are " + all);
      }
  // Contours tell more than voxels: they go first.
  auto& all = imported_.structures;
  std::vector<Place> places;
  for (const ImportedStructure& s : all) places.push_back(place_of(s));
  std::vector<std::size_t> order(all.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_partition(order.begin(), order.end(), [&](std::size_t n) { return !is_label(all[n]); });
  std::vector<std::size_t> kept;
  for (const std::size_t n : order) {
    const auto other = std::ranges::find_if(
        kept, [&](std::size_t k) { return is_again(all[n], places[n], all[k], places[k]); });
    if (other == kept.end())
      kept.push_back(n);
    else
      imported_.left.push_back("file " + std::to_string(all[n].file) + " of " +
                               std::to_string(imported_.files.size()) + ": " + all[n].from + ": " +
                               all[n].name + ": is " + all[*other].from + " of file " +
                               std::to_string(all[*other].file) + " again");
  }
  std::size_t number = 0;
  std::erase_if(all,
                [&](const ImportedStructure&) { return std::ranges::find(kept, number++) == kept.end(); });
  // Names that are free now.
  for (ImportedStructure& s : imported_.structures)
    if (const std::string own = plain_name(s.file_name, s.name); unique(own) == own) s.name = own;
}

void CaseStructures::leave_faulty() {
  auto& all = imported_.structures;
  if (!all.front().fault.empty()) throw UserError(all.front().fault);
  for (const ImportedStructure& s : all)
    if (!s.fault.empty()) imported_.left.push_back(s.from + ": " + s.name + ": " + s.fault);
  std::erase_if(all, [](const ImportedStructure& s) { return !s.fault.empty(); });
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string plain_name(const std::string& name, const std::string& otherwise) {
  std::string plain;
  for (const char c : without_accents(name)) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    if (is_plain && static_cast<unsigned char>(c) < 128)
      plain += c;
    else if (!plain.empty() && plain.back() != '_')
      plain += '_';
  }
  while (plain.ends_with('_')) plain.pop_back();
  plain.resize(std::min<std::size_t>(plain.size(), 32));
  if (plain.empty()) {
    const StructureRole role = role_of_name(name).role;  // "膀胱" → bladder
    return role == StructureRole::kOther ? otherwise : role_word(role);
  }
  for (const char* organ : {"prostate", "urethra", "rectum", "bladder"})
    if (lower_case(plain) == organ) return organ;
  return plain;
}

}  // namespace brachy
