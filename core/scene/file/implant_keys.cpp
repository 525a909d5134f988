#include <algorithm>
#include <string_view>

#include "core/base/number_text.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/plan/request/source_limits.h"
#include "core/brachytherapy/structures/structure_role.h"
#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

using enum Reload;

std::vector<Key<TemplateGrid>> template_keys() {
  using S = TemplateGrid;
  return {
      integer("columns", &S::columns, {1, TemplateGrid::kMaxColumns}, kRestart, "along +x"),
      integer("rows", &S::rows, {1, TemplateGrid::kMaxRows}, kRestart, "along +y"),
      number("spacing_mm", &S::spacing_mm, {1, 50}, kRestart, "between neighbouring holes"),
      numbers("origin_mm", &S::origin_mm, {-1e5, 1e5}, kRestart,
              "the hole of the least x and y, 37.5 mm in front of the phantom's apex; the middle one is on "
              "its axis"),
      text("letters_from", &S::letters_from, {"left", "right"}, kRestart,
           "where column A is: at the patient's left, as before there was this key, or at his right, as "
           "clinical "
           "templates have it: on the left of who looks at it. Rows are numbered from below"),
      flag("half_steps", &S::half_steps, kRestart,
           "columns A, a, B, b, … and rows 1, 1.5, 2, 2.5, …; else A, B, … and 1, 2, …"),
  };
}

std::vector<Key<ImplantSettings>> implant_kind_keys() {
  using S = ImplantSettings;
  return {
      text("kind", &S::kind, {"ldr", "hdr"}, kRestart,
           "ldr: needles leave seeds; hdr: they are catheters that stay, and a source dwells in them"),
      text("seeds", &S::seeds, {}, kRestart,
           "ldr: seeds that are in the body at the start, as of an earlier implant: CSV as for `brachy dose "
           "--seeds`, or a "
           "session's seeds.csv, relative to this file; empty: none"),
      number("step_mm", &S::step_mm, {2.5, 5}, kRestart, "hdr: between dwell positions: 2.5 or 5"),
      number("tip_offset_mm", &S::tip_offset_mm, {0, 50}, kRestart,
             "hdr: of the first dwell position behind the catheter's tip"),
      integer("max_catheters", &S::max_catheters, {1, S::kMaxCatheters}, kRestart,
              "hdr: of a generated plan"),
      number("source_strength_u", &S::source_strength_u, {1, 1e5}, kRestart,
             "hdr: air-kerma strength on the day; 40,300 U are 10 Ci of Ir-192"),
      alternative<S>("activity_ci", Range{0.001, 20}, 10, kRestart,
                     "hdr: of Ir-192, 4.03 U for each mCi (AAPM TG-43, 1995); in place of source_strength_u",
                     [](const TomlTable& t, S& s, double ci) {
                       if (t.has("source_strength_u"))
                         t.contradiction(
                             "activity_ci",
                             "and implant.source_strength_u both give the strength; give one of them");
                       s.source_strength_u = ci * S::kUPerCi;
                     }),
  };
}

void check_implant(const TomlTable& t, Scene& scene) {
  if (scene.implant.step_mm != 2.5 && scene.implant.step_mm != 5)
    t.contradiction("step_mm", "is " + text_of(scene.implant.step_mm) + "; it must be 2.5 or 5");
  if (scene.implant.is_hdr() && !scene.implant.seeds.empty())
    t.contradiction("seeds",
                    "are permanent ones, and implant.kind is \"hdr\"; leave them out, or make it \"ldr\"");
}

std::vector<Key<SeedSettings>> seeds_keys() {
  using S = SeedSettings;
  const std::vector<std::string> sources = {"6711", "200", "cs1-rev2"};
  return {
      text("applicator", &S::applicator, {"single", "train"}, kRestart,
           "at a press of the device's button: one seed drops at the tip; or the plan's train of that hole "
           "is held, and stays behind as the needle is withdrawn"),
      text("loading", &S::loading, {"hole", "order"}, kRestart,
           "which train a needle carries: the plan's of the hole it goes through, in a free hole the plan's "
           "next "
           "one; or always the plan's next one, whatever the hole"),
      field_key(
          "source", "text", range_text(sources), &S::source, kRestart,
          "of seeds in no plan: I-125, Amersham 6711; Pd-103, TheraSeed 200; Cs-131, IsoRay CS-1 Rev2",
          [sources](TomlTable& t, SourceModel& source) {
            std::string name(to_string(source));
            t.text("source", name, sources);
            source = *find_source(name);
          },
          [](SourceModel source) { return toml_text(std::string(to_string(source))); }),
      number("air_kerma_strength_u", &S::air_kerma_strength_u, {1e-3, 100}, kRestart,
             "of each seed in no plan; 1 U = 1 cGy cm²/h; 1 mCi of I-125 is 1.27 U"),
      integer("max_count", &S::max_count, {1, SeedSettings::kMaxCount}, kRestart,
              "seeds in the tissue at the same time"),
  };
}

void check_seeds(const TomlTable& t, Scene& scene) {
  if (scene.seeds.applicator == "train" && scene.plan_file.empty())
    t.contradiction("applicator",
                    "is \"train\", and trains are a plan's; give plan.file = \"PLAN.toml\" or make it "
                    "\"single\"");
}

std::vector<Key<DoseSettings>> dose_keys() {
  using S = DoseSettings;
  return {
      number("prescription_gy", &S::prescription_gy, {1, 1000}, kRestart,
             "where there is no plan, which has its own; not given: what ABS has for the source alone, I-125 "
             "145, "
             "Pd-103 125, Cs-131 115; hdr: of a fraction, 13.5"),
      number("spacing_mm", &S::spacing_mm, {0.25, 10}, kRestart, "of the grid"),
      number("margin_mm", &S::margin_mm, {0, 50}, kRestart, "of the grid around the prostate"),
      text("source", &S::source, {}, kRestart,
           "a name as in seeds.source, or a TG-43U1 source file relative to this one (config/README.md); "
           "empty: "
           "seeds.source, for hdr mhdr-v2"),
  };
}

// A fraction's dose is not that of seeds, and a nuclide's not another's. A source file is read later: its scene has to
// say what is prescribed where it is not 145 Gy.
void check_dose(const TomlTable& t, Scene& scene) {
  if (t.has("prescription_gy")) return;
  const auto named = find_source(scene.dose.source);
  const auto limits = source_limits(named.value_or(scene.seeds.source));
  if (scene.implant.is_hdr())
    scene.dose.prescription_gy = ImplantSettings::kFractionGy;
  else if (limits)
    scene.dose.prescription_gy = limits->customary_gy;
}

std::vector<Key<UncertaintySettings>> uncertainty_keys() {
  using S = UncertaintySettings;
  constexpr Range kPercent = {0, 30}, kLength = {0, 20};
  return {
      number("strength_percent", &S::strength_percent, kPercent, kRestart,
             "SD of the air-kerma strength, of all sources together (Kennedy 2023)"),
      number("calculation_percent", &S::calculation_percent, kPercent, kRestart,
             "of the dose that a planning system computes (Kirisits 2014)"),
      number("medium_percent", &S::medium_percent, kPercent, kRestart,
             "of tissue in place of water (Kirisits 2014)"),
      number("dwell_s", &S::dwell_s, {0, 10}, kRestart, "hdr: of each dwell's time (Kennedy 2023)"),
      number("source_along_mm", &S::source_along_mm, kLength, kRestart,
             "hdr: of the source in each catheter (Kennedy 2023)"),
      number("reconstruction_along_mm", &S::reconstruction_along_mm, kLength, kRestart,
             "hdr: of each catheter's tip as it is seen in the images (Kennedy 2023)"),
      number("reconstruction_across_mm", &S::reconstruction_across_mm, kLength, kRestart,
             "hdr: of each catheter across, in a random direction (Kennedy 2023)"),
      number("movement_along_mm", &S::movement_along_mm, kLength, kRestart,
             "hdr: of each catheter in the gland until the treatment (Kennedy 2023)"),
      number("movement_across_mm", &S::movement_across_mm, kLength, kRestart,
             "hdr: the same across, in a random direction (Kennedy 2023)"),
      number(
          "drift_mm", &S::drift_mm, kLength, kRestart,
          "hdr: of all catheters along themselves; 1.8 between fractions, 0 for one that is given at once"),
      number("gland_outline_mm", &S::gland_outline_mm, kLength, kRestart,
             "of the gland's surface, outwards everywhere (Kennedy 2023)"),
      number("urethra_outline_mm", &S::urethra_outline_mm, kLength, kRestart,
             "of the urethra's surface (Kennedy 2023)"),
      number("organ_outline_mm", &S::organ_outline_mm, kLength, kRestart,
             "of the surface of rectum, bladder and others (Kennedy 2023, rectum)"),
      numbers("gland_movement_mm", &S::gland_movement_mm, {0, 20}, kRestart,
              "of gland, urethra and implant against other organs: left-right, front-back, along (Kennedy "
              "2023)"),
      number("swelling_percent", &S::swelling_percent, kPercent, kRestart,
             "of the gland's volume after the plan; no published value for a single fraction, so 0"),
  };
}

Key<StructureSettings> role_key() {
  std::vector<std::string> words = {""};
  for (std::string& word : role_words()) words.push_back(std::move(word));
  return text(
      "role", &StructureSettings::role, words, kRestart,
      "what it is to plans, dose and viewers; empty: by its name, TG-263's or a clinic's in some twenty "
      "languages, such as Urethra_Prostatc or Rektum");
}

std::vector<Key<StructureSettings>> structure_keys() {
  using S = StructureSettings;
  return {
      text("name", &S::name, {}, kRestart, "1 to 32 letters, digits, _ and -"),
      text("file", &S::file, {}, kRestart,
           "a closed surface: STL, OBJ or PLY, in tissue.units and tissue.frame, relative to this file"),
      text("colour", &S::colour, {}, kRestart, "#rrggbb, in viewers; empty: theirs"),
      role_key(),
  };
}

std::vector<Key<DoseGoal>> goal_keys() {
  using S = DoseGoal;
  return {
      text("structure", &S::structure, {}, kLive, "whose dose: prostate, or a structure's name"),
      text("figure", &S::figure,
           {"V100", "V150", "V200", "V100cc", "D90", "D30", "D10", "D5", "D2cc", "D0.1cc"}, kLive,
           "V in % of the volume or, as V100cc, in cm³; D in Gy"),
      text("stage", &S::stage, {"plan", "implant"}, kLive,
           "whether a plan is judged by it or what was implanted"),
      text("side", &S::side, {"above", "below"}, kLive, "of the limit that the figure should be"),
      number("limit", &S::limit, {0, 1000}, kLive,
             "in the figure's unit; of a dose D in % of the prescription, also those of a volume in cm³"),
      text("source", &S::source, {}, kLive, "who recommends it; the report names it"),
  };
}

void check_goal(const TomlTable& t, Scene& scene) {
  const char* what = "a [[goal]] has at least a structure, a figure and a limit";
  for (const char* key : {"structure", "figure", "limit"})
    if (!t.has(key)) t.missing(key, what);
  if (scene.goals.back().structure.empty())
    t.contradiction("structure", "is empty; name one, such as prostate");
}

// Names of structures become names of files.
bool is_plain(std::string_view name) {
  return !name.empty() && name.size() <= 32 && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

void check_structure(const TomlTable& t, Scene& scene) {
  const StructureSettings& s = scene.structures.back();
  const char* what = "a [[structure]] has a name and the file of its closed surface";
  if (!t.has("name")) t.missing("name", what);
  if (!t.has("file")) t.missing("file", what);
  if (!is_plain(s.name))
    t.contradiction("name", "is \"" + s.name + "\"; name it with 1 to 32 letters, digits, _ and -");
  check_colour(t, s.colour);
  const auto same = std::ranges::find(scene.structures, s.name, &StructureSettings::name);
  if (&*same != &s)
    t.contradiction("name", "is \"" + s.name + "\" as that at " + same->place + "; rename one of them");
}

}  // namespace

std::vector<SceneSection> implant_sections() {
  return {
      {"template",
       "The template's grid of holes: columns along +x, rows along +y, needles along +z. A plan's file says "
       "itself how its holes are named (letters_from, half_steps; without them A, B, … from the left) and is "
       "read as that.",
       within<Scene>(
           template_keys(), [](auto& s) -> auto& { return s.template_grid; })},
      {"plan",
       "The treatment plan.",
       {text("file", &Scene::plan_file, {}, kRestart,
             "TOML or CSV, relative to this file, as `brachy plan --generate` writes it; empty: no plan")}},
      {"implant", "Seeds that stay, or catheters for an afterloader.",
       within<Scene>(
           implant_kind_keys(), [](auto& s) -> auto& { return s.implant; }),
       check_implant},
      {"seeds", "How a needle drops its seeds, and which.",
       within<Scene>(
           seeds_keys(), [](auto& s) -> auto& { return s.seeds; }),
       check_seeds},
      {"dose", "The dose report.",
       within<Scene>(
           dose_keys(), [](auto& s) -> auto& { return s.dose; }),
       check_dose},
      {"uncertainty",
       "What a plan cannot know of its treatment, as standard deviations: for `brachy robust` and "
       "`brachy plan --robust`. Kennedy 2023: Phys. Eng. Sci. Med. 46, 1115–1130; Kirisits 2014: Radiother. "
       "Oncol. 110, 199–212.",
       within<Scene>(
           uncertainty_keys(), [](auto& s) -> auto& { return s.uncertainty; })},
      {"structure",
       "A structure that dose is reported for. Plans, dose and score know it by its role. One with the role "
       "prostate "
       "is the gland; without it the whole tissue is. The phantom has a urethra and a rectum; a structure of "
       "the "
       "same role replaces them.",
       within<Scene>(
           structure_keys(), [](auto& s) -> auto& { return s.structures.back(); }),
       check_structure,
       SceneSection::List{list_key("structure", &Scene::structures, kRestart),
                          [](const TomlTable& t, Scene& scene) {
                            scene.structures.push_back({"", "", t.place()});
                          },
                          [](Scene& scene) {
                            scene.structures.push_back({"urethra", "urethra.stl", "", "#f2c94c"});
                          }}},
      {"goal",
       "What a dose figure should be, of a plan or of an implant; the score judges by them. None: those of "
       "ABS 2012, "
       "GEC-ESTRO 2007 and AAPM TG-137 for permanent implants.",
       within<Scene>(
           goal_keys(), [](auto& s) -> auto& { return s.goals.back(); }),
       check_goal,
       SceneSection::List{
           list_key("goal", &Scene::goals, kLive),
           [](const TomlTable& t, Scene& scene) { scene.goals.emplace_back().place = t.place(); },
           [](Scene& scene) {
             scene.goals.push_back({"prostate", "V100", "implant", "above", 90, "ABS 2012"});
           }}},
  };
}

}  // namespace brachy
