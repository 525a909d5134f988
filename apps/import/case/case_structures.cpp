#include "apps/import/case/case_structures.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/geometry/contours/contour_surface.h"
#include "core/geometry/label_map/label_surface.h"
#include "core/geometry/simplify/simplify.h"
#include "core/geometry/surface/surface_check.h"
#include "core/geometry/surface/surface_volume.h"

namespace brachy {

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

void CaseStructures::add_rois(const RtStructureSet& set, const std::string& file) {
  for (const RtRoi& roi : set.rois) {
    const std::string from = "ROI " + std::to_string(roi.number);
    ImportedStructure structure{
        plain_name(roi.name, "roi_" + std::to_string(roi.number)), from, roi.colour, {}, 0, 0, {}};
    progress_(structure.name);
    if (roi.other_contours > 0)
      imported_.left.push_back(from + ": " + std::to_string(roi.other_contours) + " points or open contours");
    if (!has_area(roi.contours)) {
      imported_.left.push_back(from + ": has no closed contour with an area");
      continue;
    }
    const std::string place = file + ": Contour Data (3006,0050): " + from;
    const ContourStack stack = stack_contours(roi.contours, place);
    if (stack.missing_planes > 0)
      structure.notes.push_back(std::to_string(stack.missing_planes) + " missing slices were interpolated");
    if (stack.repeated > 0)
      structure.notes.push_back(std::to_string(stack.repeated) + " contours occurred twice");
    if (stack.crossing_planes > 0)
      structure.notes.push_back("contours cross in " + std::to_string(stack.crossing_planes) +
                                " planes: what lies in two of them is taken to be outside");
    ContourSurface surface = contour_surface(stack, place);
    structure.mesh = std::move(surface.mesh);
    structure.source_cc = stack.crossing_planes > 0 ? surface.surface_cc : surface.slabs_cc;
    add(std::move(structure), file);
  }
}

void CaseStructures::add_segments(const LabelMap& map, const std::string& file) {
  imported_.left.insert(imported_.left.end(), map.notes.begin(), map.notes.end());
  for (const LabelMap::Segment& segment : map.segments) {
    const std::string from = "label " + std::to_string(segment.value) +
                             (map.layers.size() > 1 ? " of layer " + std::to_string(segment.layer) : "");
    const std::string fallback = "label_" + std::to_string(segment.value);
    const std::string name = plain_name(segment.name, fallback);
    progress_(name);
    const auto& labels = map.layers[segment.layer];
    if (std::ranges::find(labels, segment.value) == labels.end()) {
      imported_.left.push_back(from + ": no voxel has it");
      continue;
    }
    LabelSurface surface = label_surface(map.grid, labels, segment.value);
    add({name, from, segment.colour, std::move(surface.mesh), surface.voxels_cc, 0, {}}, file);
  }
}

void CaseStructures::put_gland_first() {
  auto& all = imported_.structures;
  auto gland = all.end();
  if (!options_.gland.empty()) {
    gland = std::ranges::find(all, options_.gland, &ImportedStructure::name);
    if (gland == all.end()) {
      std::string names;
      for (const auto& s : all) names.append(names.empty() ? "" : ", ").append(s.name);
      throw UserError("--gland: there is no structure \"" + options_.gland + "\"; choose from " + names);
    }
  } else {
    for (const char* word : {"prostate", "gland", "ctv", "target", "ptv", "tumor", "tumour"})
      if (gland == all.end())
        gland = std::ranges::find_if(
            all, [&](const auto& s) { return lower_case(s.name).find(word) != std::string::npos; });
    if (gland == all.end()) {
      gland = all.begin();
      if (all.size() > 1)
        imported_.left.push_back("no structure is called prostate, gland, ctv, target or ptv: \"" +
                                 gland->name +
                                 "\", the first, is taken for the gland; --gland NAME chooses another");
    }
  }
  std::rotate(all.begin(), gland, gland + 1);
  // The scene's own word, for plans and the score.
  if (all.front().name != "prostate") {
    all.front().notes.push_back("is the gland, called \"prostate\" in the scene; in the file \"" +
                                all.front().name + "\"");
    for (std::size_t s = 1; s < all.size(); ++s)
      if (all[s].name == "prostate") all[s].name = unique("prostate_other");
    all.front().name = "prostate";
  }
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string plain_name(const std::string& name, const std::string& otherwise) {
  std::string plain;
  for (const char c : name) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
    if (is_plain && static_cast<unsigned char>(c) < 128)
      plain += c;
    else if (!plain.empty() && plain.back() != '_')
      plain += '_';
  }
  while (plain.ends_with('_')) plain.pop_back();
  plain.resize(std::min<std::size_t>(plain.size(), 32));
  if (plain.empty()) return otherwise;
  for (const char* organ : {"prostate", "urethra", "rectum", "bladder"})
    if (lower_case(plain) == organ) return organ;
  return plain;
}

}  // namespace brachy
