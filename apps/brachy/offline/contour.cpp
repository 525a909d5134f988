#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/command_line/exit_code.h"
#include "apps/command_line/tool.h"
#include "core/base/error.h"
#include "core/brachytherapy/contours/contour_score.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

struct ContourOptions {
  std::filesystem::path contours;
  std::optional<std::filesystem::path> config;  ///< none: the built-in phantom
  std::string structure = "prostate";
  bool json = false;
};

nlohmann::ordered_json to_json(const ContourScore& score) {
  nlohmann::ordered_json slices = nlohmann::ordered_json::array();
  for (const SliceScore& s : score.slices) {
    nlohmann::ordered_json slice = {
        {"slice", nullptr},           {"offset_mm", s.offset_mm}, {"outlined_mm2", s.areas.first},
        {"true_mm2", s.areas.second}, {"dice", s.dice()},         {"hausdorff_mm", s.hausdorff_mm},
        {"mean_mm", s.mean_mm}};
    if (s.slice) slice["slice"] = *s.slice;
    slices.push_back(slice);
  }
  return {{"dice", score.dice},
          {"outlined_cm3", score.outlined_cm3},
          {"same_planes_cm3", score.same_planes_cm3},
          {"true_cm3", score.gland_cm3},
          {"volume_error_percent", score.step_mm > 0 ? nlohmann::ordered_json(score.volume_error_percent())
                                                     : nlohmann::ordered_json()},
          {"hausdorff_mm", score.hausdorff_mm},
          {"hausdorff_95_mm", score.hausdorff_95_mm},
          {"mean_mm", score.mean_mm},
          {"step_mm", score.step_mm},
          {"missed_planes", score.missed},
          {"planes_beyond", score.beyond},
          {"slices", slices}};
}

void print(const ContourScore& score) {
  std::cout << fmt::format("{:>6}{:>11}{:>15}{:>11}{:>7}{:>15}\n", "slice", "offset, mm", "outlined, mm2",
                           "true, mm2", "Dice", "Hausdorff, mm");
  for (const SliceScore& s : score.slices)
    std::cout << fmt::format("{:>6}{:>11.1f}{:>15.1f}{:>11.1f}{:>7.3f}{:>15}\n",
                             s.slice ? std::to_string(*s.slice) : "missed", s.offset_mm, s.areas.first,
                             s.areas.second, s.dice(),
                             s.is_missed() || s.is_beyond() ? "–" : fmt::format("{:.2f}", s.hausdorff_mm));
  std::cout << fmt::format("Dice {:.3f}; outlines: Hausdorff {:.2f} mm, 95 % {:.2f} mm, mean {:.2f} mm\n",
                           score.dice, score.hausdorff_mm, score.hausdorff_95_mm, score.mean_mm);
  if (score.step_mm > 0)
    std::cout << fmt::format(
        "volume {:.2f} cm3 outlined, {:.2f} cm3 true: {:+.1f} %; {} planes missed, {} beyond the gland\n",
        score.outlined_cm3, score.gland_cm3, score.volume_error_percent(), score.missed, score.beyond);
}

int run(const ContourOptions& options) {
  const ContourSet contours = load_contours(options.contours);
  const Scene scene = options.config ? load_scene(*options.config) : Scene{};
  const std::vector<Structure> structures = load_structures(scene);
  const Structure* structure = find_structure(structures, options.structure);
  if (!structure)
    throw UserError("--structure: the scene has no \"" + options.structure +
                    "\"; name one of its structures");
  const ContourScore score = score_contours(contours, structure->mesh);
  if (options.json)
    std::cout << to_json(score).dump() << "\n";
  else
    print(score);
  return kExitOk;
}

void declare(OptionList& list, ContourOptions& options) {
  list.add("contours", options.contours,
           "CSV slice,x_mm,y_mm,z_mm: closed outlines in parallel planes, patient RAS")
      .required();
  list.add("--config", options.config, "scene; default: the built-in phantom");
  list.add("--structure", options.structure, "of the scene, that was outlined").show_default();
  list.add_flag("--json", options.json, "print the result as JSON");
}

}  // namespace

Tool contour_tool() {
  return make_tool<ContourOptions>("contour", "Score the outlines of a volume study against the gland.",
                                   R"(Examples:
  brachy contour contours.csv --config config/prostate.toml
  brachy contour contours.csv --structure urethra --json
Dice over all planes that the gland or an outline is in, volume by planimetry against the gland's own, and distances
between outlines. The truth is the structure at rest, as the scene has it before a needle or the probe moves it.
Exit codes: 0 done, 2 bad input.)",
                                   declare, run);
}

}  // namespace brachy
