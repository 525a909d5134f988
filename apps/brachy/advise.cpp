#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/brachy/tools.h"
#include "core/choice/choice.h"
#include "core/compact/compact_kernel.h"
#include "core/contact/landmark_stiffness.h"
#include "core/kernels/kernels.h"
#include "core/scene/load_body.h"
#include "core/scene/scene_file.h"

namespace brachy {
namespace {

/// Supports of a ψ kernel between folding and rounding.
struct Window {
  std::string kernel;
  double least_mm, most_mm;
};

// λmin of K for landmarks q apart on a shaft: c (q/a)^p (DESIGN §4, measured).
struct Conditioning {
  std::string_view kernel;
  double c, p;
};
constexpr std::array<Conditioning, 4> kShaft = {
    {{"psi31", 5.0, 3}, {"psi30", 1.0, 1}, {"psi32", 77, 5}, {"buhmann", 8.0, 3}}};

// How far a tip takes the tissue along before it punctures or cuts, mm.
double largest_push(const Scene& scene) {
  const TissueContact& contact = scene.tissue.contact;
  return std::max(contact.puncture_force_n, contact.cutting_force_n) /
         elastic_landmark_stiffness(1e-3 * scene.tissue.shear_modulus_kpa, scene.tissue.poisson,
                                    scene.contact.tip_core_mm);
}

// Below, a landmark displaced as far as the contact lets it folds the field (a > M |d|), or takes more than three
// sub-steps where the scene composes them; above, K's condition exceeds 10¹⁰, for landmarks as near as the tip comes to
// one on the shaft.
std::vector<Window> windows(const Scene& scene) {
  constexpr double kMostCondition = 1e10, kTipDistance = 0.25;
  const double d = largest_push(scene) / (scene.stability.policy == "substep" ? 3 : 1);
  const double q = kTipDistance * scene.contact.landmark_spacing_mm;
  std::vector<Window> all;
  for (const Conditioning& k : kShaft) {
    const double most = q * std::pow(k.c * kMostCondition / scene.contact.max_landmarks, 1 / k.p);
    all.push_back({std::string(k.kernel), max_slope(*find_kernel(k.kernel)) * d, std::min(most, 500.0)});
  }
  return all;
}

/// How far the fitted rungs are from the elastic kernel that they are fitted to, in the scene's tissue.
double fit_residual(const ElasticBody& body, CompactRung rung) {
  double residual = 0;
  CompactKernel::of_body(body, rung, &residual);
  return residual;
}

/// Of each kernel, with or without anchors, the candidate with the least error; and whatever is chosen.
std::vector<Candidate> worth_listing(const std::vector<Candidate>& all, const Candidate& chosen) {
  std::vector<Candidate> best;
  for (const Candidate& c : all) {
    const auto same = std::ranges::find_if(best, [&](const Candidate& b) {
      return b.settings.kernel == c.settings.kernel && b.settings.has_anchors == c.settings.has_anchors;
    });
    if (same == best.end())
      best.push_back(c);
    else if (c.error_mm < same->error_mm)
      *same = c;
  }
  if (std::ranges::none_of(best,
                           [&](const Candidate& b) { return b.settings.model == chosen.settings.model; }))
    best.push_back(chosen);
  std::ranges::stable_sort(best, {}, &Candidate::tick_ms);
  return best;
}

}  // namespace

int advise(const AdviseOptions& options) {
  const Scene scene = load_scene(options.scene);
  const ElasticBody body = load_body(scene);
  const Needs needs{options.tolerance_mm.value_or(scene.model.tolerance_mm),
                    options.tick_budget_ms.value_or(scene.model.tick_budget_ms),
                    scene.model.needs == "surface"};
  const auto& rows = stored_comparison();
  const std::vector<std::string> scenes = nearest_scenes(body, rows);
  const Choice choice = choose(body, needs, rows);
  const auto listed = worth_listing(candidates(scenes, rows, needs.surface_only), choice.candidate);
  const std::vector<Window> valid = windows(scene);

  const std::array<std::pair<const char*, double>, 2> fits = {
      {{"multiscale", fit_residual(body, CompactRung::kMultiscale)},
       {"compact_elastic", fit_residual(body, CompactRung::kCompactElastic)}}};

  if (options.json) {
    nlohmann::ordered_json json = {{"nearest_scenes", scenes},
                                   {"tolerance_mm", needs.tolerance_mm},
                                   {"tick_budget_ms", needs.tick_budget_ms},
                                   {"choice", choice.candidate.settings.model},
                                   {"meets_needs", choice.meets_needs},
                                   {"reason", choice.reason}};
    for (const Window& w : valid)
      json["supports_mm"][w.kernel] = {{"least", w.least_mm}, {"most", w.most_mm}};
    for (const auto& [rung, residual] : fits) json["fit_residual"][rung] = residual;
    for (const Candidate& c : listed)
      json["rungs"].push_back({{"model", c.settings.model},
                               {"kernel", c.settings.kernel},
                               {"error_mm", c.error_mm},
                               {"tick_ms", c.tick_ms},
                               {"min_det", c.settings.min_det}});
    std::cout << json.dump() << "\n";
    return kExitOk;
  }
  std::cout << "support radii that neither fold nor lose their digits:\n";
  for (const Window& w : valid)
    std::cout << fmt::format("  {:8} {:6.1f} … {:.4g} mm\n", w.kernel, w.least_mm, w.most_mm);
  for (const auto& [rung, residual] : fits)
    std::cout << fmt::format("weights of {}, fitted: {:.1f} % from the elastic kernel\n", rung,
                             100 * residual);
  std::cout << "rungs, as charted on the nearest reference scenes (";
  for (std::size_t i = 0; i < scenes.size(); ++i) std::cout << (i ? ", " : "") << scenes[i];
  std::cout << "):\n  model                       error, mm   tick, ms\n";
  for (const Candidate& c : listed)
    std::cout << fmt::format("  {:27} {:9.2f}  {:9.3f}{}{}\n", c.settings.model, c.error_mm, c.tick_ms,
                             c.settings.min_det <= 0 ? "  folds" : "",
                             c.settings.model == choice.candidate.settings.model ? "  <- auto" : "");
  std::cout << choice.reason << "\n";
  return kExitOk;
}

}  // namespace brachy
