#include <iostream>
#include <sstream>

#include "apps/brachy/files/structure_files.h"
#include "apps/brachy/offline/cbc.h"
#include "apps/brachy/offline/hdr_plan_tool.h"
#include "apps/brachy/offline/plan_report.h"
#include "apps/brachy/offline/plan_session.h"
#include "apps/brachy/offline/plan_strengths.h"
#include "apps/command_line/output_file.h"
#include "apps/command_line/tool.h"
#include "apps/session/session_manifest.h"
#include "apps/terminal/progress.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/plan/request/make_plan.h"
#include "core/brachytherapy/plan/request/source_limits.h"
#include "core/brachytherapy/robust/robust_planning.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/geometry/surface/surface_bvh.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

struct PlanOptions {
  std::optional<std::filesystem::path> plan;    ///< none: the scene's
  bool generate = false;                        ///< generate one instead
  std::optional<std::filesystem::path> config;  ///< none: the built-in phantom
  std::optional<std::filesystem::path> out, csv, seeds, structures, trajectory;  ///< to write
  double speed_mm_s = 50, drop_speed_mm_s = 20;                                  ///< of the trajectory
  bool hdr = false;  ///< catheters, whatever the scene says
  std::string method = "annealing";
  bool robust = false;
  std::optional<double> strength_u;
  std::vector<double> strengths_u;  ///< to compare; empty: one plan
  std::optional<int> max_needles, max_seeds, max_seeds_per_needle;
  bool fewest_needles = false;
  std::vector<std::string> forbidden, locked;  ///< holes
  Margins margins;
  std::uint64_t seed = 1;
  double seconds = 60;                          ///< of the integer programme's solver
  std::optional<std::filesystem::path> placed;  ///< seeds in place
  bool json = false, force = false, what_if = false;
};

/// Seeds that are in place.
struct PlacedSeeds {
  std::vector<DoseSeed> seeds;
  std::vector<std::int32_t> planned;  // their numbers in the plan; empty: of none
};

/// Those of --placed, else those that the scene has at the start.
PlacedSeeds load_placed(const PlanOptions& options, const Scene& scene) {
  if (!options.placed) return {at_rest(load_seeds_at_start(scene)), {}};
  const std::vector<Seed> seeds = load_seeds_in_place(*options.placed);
  PlacedSeeds placed{at_rest(seeds), {}};
  if (!std::ranges::all_of(seeds, &Seed::was_there))
    for (const Seed& seed : seeds) placed.planned.push_back(seed.planned);
  return placed;
}

/// Throws UserError where the template has no such hole.
void check_holes(const std::vector<std::string>& holes, const char* option, const TemplateGrid& grid) {
  for (const std::string& hole : holes)
    if (!grid.position(hole)) throw UserError(std::string(option) + " " + hole + ": " + grid.lacks(hole));
}

/// The needles through those holes alone.
Plan needles_in(Plan plan, const std::vector<std::string>& holes) {
  for (const std::string& hole : holes)
    if (std::ranges::find(plan.needles, hole, &PlanNeedle::hole) == plan.needles.end())
      throw UserError("--lock " + hole + ": the plan has no needle there");
  std::erase_if(plan.needles, [&](const PlanNeedle& needle) {
    return std::ranges::find(holes, needle.hole) == holes.end();
  });
  return plan;
}

Plan written_plan(const PlanOptions& options, const Scene& scene) {
  if (options.plan) return load_plan(*options.plan, scene.template_grid, scene.needle.length_mm);
  if (auto plan = load_plan(scene)) return *plan;
  throw UserError("no plan: name one, or a scene with plan.file, or generate one with --generate");
}

PlanRequest request_of(const PlanOptions& options, const Scene& scene) {
  PlanRequest request;
  request.settings = {scene.name, scene.seeds.source, scene.dose.prescription_gy, scene.needle.length_mm,
                      static_cast<std::size_t>(scene.seeds.max_count)};
  request.method = options.method == "rule"      ? PlanMethod::kRule
                   : options.method == "integer" ? PlanMethod::kInteger
                                                 : PlanMethod::kAnnealing;
  request.strength_u = options.strength_u;
  request.scene_u = scene.seeds.air_kerma_strength_u;
  request.goals = scene.goals;
  request.how.seed = options.seed;
  request.how.most_needles = static_cast<std::size_t>(options.max_needles.value_or(0));
  request.how.most_seeds = static_cast<std::size_t>(options.max_seeds.value_or(0));
  request.how.most_seeds_a_needle =
      static_cast<std::size_t>(options.max_seeds_per_needle.value_or(NeedleLoad::kMostElements));
  request.fewest_needles = options.fewest_needles;
  request.margins = options.margins;
  check_holes(options.forbidden, "--forbid", scene.template_grid);
  check_holes(options.locked, "--lock", scene.template_grid);
  for (const std::string& hole : options.locked)
    if (std::ranges::find(options.forbidden, hole) != options.forbidden.end())
      throw UsageError("--lock and --forbid both name " + hole + ": leave it out of one");
  request.how.forbidden_holes = options.forbidden;
  if (!options.locked.empty()) {
    const Plan& kept = request.how.kept = needles_in(written_plan(options, scene), options.locked);
    request.settings.source = kept.source;
    request.settings.prescription_gy = kept.prescription_gy;
    if (!request.strength_u) request.strength_u = kept.air_kerma_strength_u;
    if (*request.strength_u != kept.air_kerma_strength_u)
      throw UsageError("--lock keeps needles of " + text_of(kept.air_kerma_strength_u) +
                       " U a seed: leave out --strength-u");
  }
  if (options.robust) {
    request.how.make_robust();
    request.how.noise = placement_noise(scene.uncertainty, seed_misplacement(scene));
  }
  request.solve = [&options](const std::string& programme) {
    return solve_with_cbc(programme, options.seconds);
  };
  return request;
}

MadePlan replanned(const PlanOptions& options, const Scene& scene, const std::vector<Structure>& structures,
                   const PlacedSeeds& placed) {
  MadePlan made;
  const Plan left =
      remaining_needles(written_plan(options, scene), scene.template_grid, placed.seeds, placed.planned);
  if (left.needles.empty()) throw PlanRefused("no needle of the plan is left: all have seeds in place");
  OptimiserSettings how = replan_settings(options.seed);
  how.objective.add_goals(scene.goals);
  OptimisedPlan found =
      replan(structures, scene.template_grid, left, placed.seeds, scene.needle.length_mm, how);
  if (found.plan.needles.empty())
    throw PlanRefused("no further seed improves the implant: the seeds in place are enough");
  made.plan = std::move(found.plan);
  bool assumed = false;
  made.structures = with_urethra(structures, assumed);
  if (assumed)
    made.notes.push_back("urethra assumed: the scene has none; see the plan that this one goes on from");
  return made;
}

MadePlan get_plan(const PlanOptions& options, const Scene& scene, const std::vector<Structure>& structures,
                  const PlacedSeeds& placed) {
  if (options.placed) return replanned(options, scene, structures, placed);
  if (!options.generate) return {written_plan(options, scene), {}, structures};
  if (!placed.seeds.empty())
    throw UserError(
        options.config->string() + ": has " + std::to_string(placed.seeds.size()) +
        " seeds in the body (implant.seeds), and a new plan is for a gland without any; name the plan to go "
        "on from, and give --placed " +
        scene.resolve(scene.implant.seeds).string());
  Progress progress("plan");
  return make_plan(structures, scene.template_grid, request_of(options, scene),
                   [&](double share) { progress.show(share, "plans for the gland"); });
}

DoseStage dose_of(const MadePlan& made, const Scene& scene, const PlacedSeeds& placed) {
  DoseSettings settings = scene.dose;
  settings.prescription_gy = made.plan.prescription_gy;
  ImplantDose implant(made.structures, settings);
  for (const PlannedSeed& seed : made.plan.seeds(scene.template_grid)) implant.add(seed);
  for (const DoseSeed& seed : placed.seeds) implant.add(seed);
  return {implant.seed_count(), implant.evaluate()};
}

std::string session_csv(const Plan& plan, const TemplateGrid& grid, const PlanOptions& options) {
  std::ostringstream text;
  write_trajectory(text, session_of(plan, grid, {options.speed_mm_s, options.drop_speed_mm_s}));
  return text.str();
}

double customary_u(const Plan& plan, const Structure& gland) {
  const SurfaceBvh surface(gland.mesh);
  return customary_strength_u(plan.source, plan.prescription_gy, (surface.max() - surface.min()).sum() / 30);
}

/// Whether there is an option that only plans of seeds have.
bool asks_for_seeds(const PlanOptions& options) {
  return !options.locked.empty() || !options.forbidden.empty() || options.fewest_needles ||
         options.max_seeds_per_needle || !options.strengths_u.empty() || options.margins.mm > 0 ||
         options.margins.posterior_mm > 0;
}

int run_plan(const PlanOptions& options) {
  if (options.placed && !options.generate)
    throw UsageError("--placed plans what is left; give --generate too");
  if (options.plan && options.generate && !options.placed && options.locked.empty())
    throw UsageError("--generate makes a plan; leave out " + options.plan->string() +
                     ", or give --placed or --lock");
  if (options.method != "annealing" && (options.fewest_needles || options.max_seeds_per_needle ||
                                        !options.forbidden.empty() || !options.locked.empty()))
    throw UsageError(
        "--lock, --forbid, --fewest-needles and --max-seeds-per-needle are of --method annealing");
  if (options.out && options.out->extension() != ".toml" && options.out->extension() != ".csv")
    throw UsageError("--out writes a plan: name it .toml or .csv");
  Scene scene = options.placed   ? load_scene_for(*options.placed, options.config, options.what_if).scene
                : options.config ? load_scene(*options.config)
                                 : Scene();
  if (options.hdr && !scene.implant.is_hdr()) make_hdr(scene);
  if (scene.implant.is_hdr() || (options.plan && is_hdr_plan_file(*options.plan))) {
    if (asks_for_seeds(options))
      throw UsageError(
          "this is a plan of catheters: --lock, --forbid, --fewest-needles, --max-seeds-per-needle, "
          "--strengths and margins are of plans of seeds");
    return run_hdr_plan(
        {options.plan, options.generate, options.robust, options.out, options.seeds, options.structures,
         options.trajectory, options.speed_mm_s, options.json, options.force},
        scene);
  }
  const std::vector<Structure> structures = load_structures(scene);
  if (!options.strengths_u.empty())
    return compare_strengths(options.strengths_u, request_of(options, scene), structures, scene,
                             options.json);
  const PlacedSeeds placed = load_placed(options, scene);
  const MadePlan made = get_plan(options, scene, structures, placed);
  const Plan& plan = made.plan;
  const TemplateGrid& grid = scene.template_grid;

  if (options.out)
    write_text(
        *options.out,
        options.out->extension() == ".csv" ? to_csv(plan, grid, made.notes) : to_toml(plan, grid, made.notes),
        options.force);
  if (options.csv) write_text(*options.csv, to_csv(plan, grid, made.notes), options.force);
  const std::vector<PlannedSeed> seeds = plan.seeds(grid);
  if (options.seeds)
    write_text(*options.seeds, to_csv(std::vector<DoseSeed>(seeds.begin(), seeds.end())), options.force);
  if (options.structures) write_structures(*options.structures, made.structures, options.force);
  if (options.trajectory) write_text(*options.trajectory, session_csv(plan, grid, options), options.force);

  const PlanReport report{plan,
                          grid,
                          dose_of(made, scene, placed),
                          customary_u(plan, structures.front()),
                          scene.goals.empty() ? default_dose_goals() : scene.goals,
                          made.notes,
                          placed.seeds.size()};
  std::cout << (options.json ? to_json(report) + "\n" : to_text(report));
  return kExitOk;
}

int run(const PlanOptions& options) {
  try {
    return run_plan(options);
  } catch (const PlanRefused& e) {
    std::cerr << "brachy plan: refused: " << e.what() << "\n";
    return kExitRefused;
  }
}

void declare(OptionList& list, PlanOptions& options) {
  list.add("plan", options.plan, "plan (.toml or .csv); default: the scene's plan.file");
  const Option generate =
      list.add_flag("--generate", options.generate, "generate a plan for the scene's gland");
  list.add("--method", options.method, "annealing, integer (by the program cbc), or rule")
      .one_of({"annealing", "integer", "rule"})
      .show_default()
      .needs(generate);
  list.add_flag("--robust", options.robust,
                "that meets its goals in most treatments drawn from the scene's [uncertainty] and [noise]: "
                "`brachy robust`")
      .needs(generate);
  const Option strength = list.add("--strength-u", options.strength_u,
                                   "of each seed; default: the scene's, where its source has such seeds")
                              .needs(generate);
  list.add("--max-needles", options.max_needles, "default: 25 up to 50 cc").range(1, 200).needs(generate);
  list.add("--max-seeds", options.max_seeds,
           "default: 90 up to 50 cc, or what makes up the customary strength")
      .range(1, 4096)
      .needs(generate);
  const Option max_per_needle =
      list.add("--max-seeds-per-needle", options.max_seeds_per_needle, "default: as its train can hold")
          .range(1, NeedleLoad::kMostElements)
          .needs(generate);
  const Option fewest = list.add_flag("--fewest-needles", options.fewest_needles,
                                      "try fewer needles until a goal is missed; some plans' time")
                            .needs(generate);
  const Option forbid = list.add("--forbid", options.forbidden, "holes that no needle goes through: D4,E3")
                            .comma_separated()
                            .needs(generate);
  const Option lock =
      list.add("--lock", options.locked,
               "holes of the plan that is given (or the scene's) whose needles stay as they are")
          .comma_separated()
          .needs(generate);
  const Option margin = list.add("--margin-mm", options.margins.mm, "around the gland, planned for with it")
                            .range(0.0, 10.0)
                            .show_default()
                            .needs(generate);
  const Option posterior =
      list.add("--posterior-margin-mm", options.margins.posterior_mm, "the margin towards the rectum")
          .range(0.0, 10.0)
          .show_default()
          .needs(generate);
  const Option strengths =
      list.add("--strengths", options.strengths_u, "a plan of each strength, U, in one table: 0.4,0.5,0.6")
          .comma_separated()
          .needs(generate)
          .excludes(strength)
          .excludes(lock);
  list.add("--random-seed", options.seed, "of the annealing").show_default().needs(generate);
  list.add("--seconds", options.seconds, "of cbc").range(1.0, 86400.0).show_default().needs(generate);
  const Option placed = list.add("--placed", options.placed,
                                 "seeds in place (a session's seeds.csv, or a table as for `brachy dose`): "
                                 "plan the needles that "
                                 "are left")
                            .needs(generate);
  for (const Option& other : {max_per_needle, fewest, forbid, lock, margin, posterior, strengths})
    placed.excludes(other);
  list.add_flag("--hdr", options.hdr, "of catheters for an afterloader, as with implant.kind = \"hdr\"");
  list.add("--config", options.config, "scene file (TOML); default: the built-in phantom");
  list.add_output("--out", options.out, "plan to write, .toml or .csv").excludes(strengths);
  list.add_output("--csv", options.csv, "plan to write as CSV").excludes(strengths);
  list.add_output("--seeds", options.seeds,
                  "CSV to write, for `brachy dose`: x,y,z,ax,ay,az,source,strength_u")
      .excludes(strengths);
  list.add_output_folder("--structures", options.structures,
                         "directory to write the structures to (.vtp, .pvd)")
      .excludes(strengths);
  const Option trajectory =
      list.add_output("--trajectory", options.trajectory, "CSV to write: a session by the plan")
          .excludes(strengths);
  list.add("--speed-mm-s", options.speed_mm_s, "of the session's tip")
      .range(0.1, 1000.0)
      .show_default()
      .needs(trajectory);
  list.add("--drop-speed-mm-s", options.drop_speed_mm_s, "of the tip while it drops its seeds")
      .range(0.1, 1000.0)
      .show_default()
      .needs(trajectory);
  list.add_flag("--what-if", options.what_if, "--placed may be a session's of another scene").needs(placed);
  list.add_force(options.force);
  list.add_flag("--json", options.json, "print the report as JSON");
}

}  // namespace

Tool plan_tool() {
  return make_tool<PlanOptions>("plan", "Generate a plan for a scene, or check one: needles, seeds, dose.",
                                R"(Examples:
  brachy plan --generate --config config/prostate.toml --out plan.toml
  brachy plan --generate --robust --strength-u 0.6 --out plan.toml
  brachy plan --generate --strengths 0.4,0.5,0.6 --config config/prostate.toml
  brachy plan edited.toml --generate --lock D4,J4 --forbid G5 --fewest-needles --out plan.toml
  brachy plan --generate --margin-mm 3 --config config/prostate.toml
  brachy plan --generate --config config/session.toml --placed seeds.csv --out rest.toml
  brachy plan plan.toml --config config/prostate.toml --json
  brachy plan plan.toml --seeds seeds.csv --structures out/structures; brachy dose --seeds seeds.csv …
  brachy plan --config config/session.toml --trajectory session.csv
  brachy plan --generate --hdr --out hdr.toml; brachy plan --config config/hdr.toml --trajectory hdr.csv
A generated plan has seeds of a given strength; holes, depths and trains are chosen by simulated annealing.
--method rule: modified peripheral loading, with the strength that it needs. A plan is checked against the
scene's template and needle. Figures are of the gland at rest; those that miss their goal are marked. What was
assumed (a urethra that the scene lacks) is noted in the plan, the report and the JSON.
HDR (--hdr, or a scene's implant.kind): catheters, dwell positions and times optimised for V100, V150, urethra
D10 and D2cc; --seeds writes the dwells as seeds of the same dose; --trajectory inserts all catheters, each a
needle of its own, and leaves them.
--trajectory: a device that goes to every planned tip in turn and drops its train there (button = 1), for
`brachy replay` and a scene with seeds.applicator = "train".
Exit codes: 0 done, 2 bad input, 3 refused: cannot be planned, with what can be.)",
                                declare, run);
}

}  // namespace brachy
