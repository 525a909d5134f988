#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/command_line/tool.h"
#include "core/elasticity/compact/compact_kernel.h"
#include "core/elasticity/landmark_stiffness.h"
#include "core/kernels/kernels.h"
#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"

namespace brachy {
namespace {

struct AdviseOptions {
  std::filesystem::path scene;
  std::optional<double> tolerance_mm, tick_budget_ms;  ///< none: the scene's
  bool json = false;
};

/// Supports of a ψ kernel between folding and rounding.
struct Window {
  std::string kernel;
  double least_mm, most_mm;
};

// Displacement of the tissue by a tip before it punctures or cuts, mm.
double largest_push(const Scene& scene) {
  const TissueContact& contact = scene.tissue.contact;
  return std::max(contact.puncture_force_n, contact.cutting_force_n) /
         elastic_landmark_stiffness(1e-3 * scene.tissue.shear_modulus_kpa, scene.tissue.poisson,
                                    scene.contact.inserted_tip_core_mm());
}

// Below this range a landmark displaced as far as the contact allows folds the field (a > M |d|), or needs more than
// three sub-steps where the scene composes them; above it K's condition number exceeds 10¹⁰, for landmarks as near as
// the tip comes to one on the shaft.
std::vector<Window> windows(const Scene& scene) {
  constexpr double kMostCondition = 1e10, kTipDistance = 0.25;
  const double d = largest_push(scene) / (scene.stability.policy == "substep" ? 3 : 1);
  const double q = kTipDistance * scene.contact.landmark_spacing_mm;
  std::vector<Window> all;
  for_each_kernel([&](auto kernel) {
    const EigenvalueLaw law = kernel.kEigenvalueLaw;
    const double most =
        q * std::pow(law.on_shaft * kMostCondition / scene.contact.max_landmarks, 1.0 / law.power);
    all.push_back({std::string(kernel.kName), kernel.kMaxSlope * d, std::min(most, 500.0)});
  });
  return all;
}

/// How far compact_elastic is from the elastic kernel that it is fitted to, in the scene's tissue.
double fit_residual(const ElasticBody& body) {
  double residual = 0;
  CompactKernel::of_body(body, &residual);
  return residual;
}

/// Of each kernel, with or without anchors, the candidate with the least error; and the chosen one.
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

int run(const AdviseOptions& options) {
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

  const double residual = fit_residual(body);

  if (options.json) {
    nlohmann::ordered_json json = {{"nearest_scenes", scenes},
                                   {"tolerance_mm", needs.tolerance_mm},
                                   {"tick_budget_ms", needs.tick_budget_ms},
                                   {"choice", choice.candidate.settings.model},
                                   {"meets_needs", choice.meets_needs},
                                   {"reason", choice.reason}};
    for (const Window& w : valid)
      json["supports_mm"][w.kernel] = {{"least", w.least_mm}, {"most", w.most_mm}};
    json["fit_residual"]["compact_elastic"] = residual;
    for (const Candidate& c : listed)
      json["models"].push_back({{"model", c.settings.model},
                                {"kernel", c.settings.kernel},
                                {"error_mm", c.error_mm},
                                {"tick_ms", c.tick_ms},
                                {"min_det", c.settings.min_det}});
    std::cout << json.dump() << "\n";
    return kExitOk;
  }
  std::cout << "support radii without folding or loss of precision:\n";
  for (const Window& w : valid)
    std::cout << fmt::format("  {:8} {:6.1f} … {:.4g} mm\n", w.kernel, w.least_mm, w.most_mm);
  std::cout << fmt::format("weights of compact_elastic, fitted: {:.1f} % from the elastic kernel\n",
                           100 * residual);
  std::cout << "models, as charted on the nearest reference scenes (";
  for (std::size_t i = 0; i < scenes.size(); ++i) std::cout << (i ? ", " : "") << scenes[i];
  std::cout << "):\n  model                       error, mm   tick, ms\n";
  for (const Candidate& c : listed)
    std::cout << fmt::format("  {:27} {:9.2f}  {:9.3f}{}{}\n", c.settings.model, c.error_mm, c.tick_ms,
                             c.settings.min_det <= 0 ? "  folds" : "",
                             c.settings.model == choice.candidate.settings.model ? "  <- auto" : "");
  std::cout << choice.reason << "\n";
  return kExitOk;
}

void declare(OptionList& list, AdviseOptions& options) {
  list.add("scene", options.scene, "scene file (TOML)").required();
  list.add("--tolerance-mm", options.tolerance_mm, "largest error of what ticks show; default: the scene's")
      .range(1e-3, 100.0);
  list.add("--tick-budget-ms", options.tick_budget_ms, "of one thread; default: the scene's")
      .range(1e-3, 1000.0);
  list.add_flag("--json", options.json, "print the advice as JSON");
}

}  // namespace

Tool advise_tool() {
  return make_tool<AdviseOptions>(
      "advise", "Recommend a model for a scene: supports, errors and costs, and the choice.",
      R"(Examples:
  brachy advise config/prostate.toml
  brachy advise config/prostate.toml --tolerance-mm 0.2 --tick-budget-ms 5 --json
Errors and times are those of the comparison stored in the program (brachy compare); nothing is measured.)",
      declare, run);
}

}  // namespace brachy
