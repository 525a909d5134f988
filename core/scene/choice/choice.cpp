#include "core/scene/choice/choice.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "core/scene/load_body.h"

namespace brachy {
namespace {

constexpr double kSame = 1e-9;

double contrast_of(const ElasticBody& body) {
  return body.regions.empty() ? 1 : body.regions.front()->shear_modulus / body.shear_modulus;
}

int free_faces_of(const ElasticBody& body) {
  return static_cast<int>(std::ranges::count(body.held, false));
}

std::string rounded(double v) {
  std::ostringstream out;
  out.precision(2);
  out << v;
  return out.str();
}

std::string listed(const std::vector<std::string>& names) {
  std::string list;
  for (const auto& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

std::vector<std::string> nearest_scenes(const ElasticBody& body, const std::vector<ChartedRow>& rows) {
  const auto distance = [&](const ChartedRow& row) {
    return std::abs(std::log2(row.contrast / contrast_of(body))) +
           std::abs(row.free_faces - free_faces_of(body));
  };
  double least = std::numeric_limits<double>::max();
  for (const ChartedRow& row : rows) least = std::min(least, distance(row));
  std::vector<std::string> scenes;
  for (const ChartedRow& row : rows)
    if (distance(row) < least + kSame && std::ranges::find(scenes, row.scene) == scenes.end())
      scenes.push_back(row.scene);
  return scenes;
}

std::vector<Candidate> candidates(const std::vector<std::string>& scenes, const std::vector<ChartedRow>& rows,
                                  bool surface_only) {
  std::map<std::string, std::pair<Candidate, std::size_t>> by_model;
  for (const ChartedRow& row : rows) {
    if (row.is_surface != surface_only || std::ranges::find(scenes, row.scene) == scenes.end()) continue;
    auto& [candidate, count] = by_model[row.model];
    const double spacing = std::max(candidate.settings.landmark_spacing_mm, row.landmark_spacing_mm);
    const double det = count > 0 ? std::min(candidate.settings.min_det, row.min_det) : row.min_det;
    if (count == 0 || row.error_mm > candidate.error_mm) candidate.settings = row;
    candidate.settings.landmark_spacing_mm = spacing;
    candidate.settings.min_det = det;
    candidate.error_mm = std::max(candidate.error_mm, row.error_mm);
    candidate.tick_ms = std::max(candidate.tick_ms, row.tick_ms);
    ++count;
  }
  std::vector<Candidate> all;
  for (const auto& [model, entry] : by_model)
    if (entry.second == scenes.size()) all.push_back(entry.first);
  std::ranges::stable_sort(all, {}, &Candidate::tick_ms);
  return all;
}

Choice choose(const ElasticBody& body, const Needs& needs, const std::vector<ChartedRow>& rows) {
  const std::vector<std::string> scenes = nearest_scenes(body, rows);
  std::vector<Candidate> all = candidates(scenes, rows, needs.surface_only);
  std::erase_if(all, [&](const Candidate& c) { return c.settings.min_det <= 0; });
  const auto figures = [](const Candidate& c) {
    return c.settings.model + " (" + rounded(c.error_mm) + " mm, " + rounded(c.tick_ms) + " ms a tick)";
  };
  const std::string asked =
      rounded(needs.tolerance_mm) + " mm within " + rounded(needs.tick_budget_ms) + " ms a tick";
  Choice choice;
  for (const Candidate& c : all)
    if (c.error_mm <= needs.tolerance_mm && c.tick_ms <= needs.tick_budget_ms) {
      choice = {c, true, {}};
      choice.reason =
          "auto: " + figures(c) + ", the cheapest model charted for " + asked + " on " + listed(scenes);
      return choice;
    }
  const Candidate* best = nullptr;
  for (const Candidate& c : all)
    if (c.tick_ms <= needs.tick_budget_ms && (!best || c.error_mm < best->error_mm)) best = &c;
  if (!best) best = &all.front();
  choice = {*best, false, {}};
  choice.reason = "auto: no model is charted for " + asked + " on " + listed(scenes) +
                  "; took the nearest, " + figures(*best) +
                  "; raise model.tolerance_mm or model.tick_budget_ms";
  return choice;
}

Scene with_choice(const Scene& scene, std::string* reason) {
  if (scene.model.kernel != "auto") return scene;
  const bool surface = scene.model.needs == "surface";
  const Choice choice = choose(
      load_body(scene), {scene.model.tolerance_mm, scene.model.tick_budget_ms, surface}, stored_comparison());
  if (reason) *reason = choice.reason;
  const ChartedRow& settings = choice.candidate.settings;
  Scene chosen = scene;
  chosen.model.kernel = settings.kernel;
  if (settings.support_mm > 0) chosen.model.support_radius_mm = settings.support_mm;
  chosen.anchors.count = settings.has_anchors ? 8 : 0;
  if (settings.landmark_spacing_mm > 0) {
    chosen.contact.landmark_spacing_mm = settings.landmark_spacing_mm;
    const double most = std::ceil(scene.needle.length_mm / settings.landmark_spacing_mm) + 1;
    chosen.contact.max_landmarks = std::max(chosen.contact.max_landmarks, static_cast<int>(most));
  }
  if (surface) chosen.tissue.points = 0;  // the surface alone
  return chosen;
}

}  // namespace brachy
