#include <iostream>

#include "apps/brachy/output_file.h"
#include "apps/brachy/tools.h"
#include "apps/recording/recording_file.h"
#include "apps/score/report.h"
#include "apps/terminal/progress.h"
#include "core/error.h"
#include "core/plan/plan_file.h"
#include "core/scene/scene_file.h"

namespace brachy {
namespace {

Plan plan_of(const ScoreOptions& options, const Scene& scene) {
  if (options.plan) return load_plan(*options.plan, scene.template_grid, scene.needle.length_mm);
  if (const auto plan = load_plan(scene)) return *plan;
  throw UserError(options.recording.string() +
                  ": has no plan to be judged by; give it with --plan, or a scene that "
                  "has plan.file with --config");
}

std::filesystem::path page_of(const ScoreOptions& options) {
  const std::filesystem::path page = options.out.value_or(options.recording / "report.html");
  if (page.extension() == ".json")
    throw UserError(page.string() + ": is the name of the JSON; give the page another, like report.html");
  return page;
}

}  // namespace

int score(const ScoreOptions& options) {
  if (is_recording_file(options.recording))
    throw UserError(options.recording.string() +
                    ": is a recording in one file; write it into a folder with `brachy export " +
                    options.recording.string() + " --out DIR` and score that");
  const std::filesystem::path page = page_of(options);
  if (options.out) check_folder_of(page);
  const Scene scene = options.config ? load_scene(*options.config) : Scene{};
  Progress progress("score");
  const Score score = write_report(options.recording, plan_of(options, scene), scene, page,
                                   [&](double share) { progress.show(share); });
  progress.finish();
  for (const std::string& remark : score.remarks) std::cerr << "brachy: " << remark << "\n";
  if (options.json)
    std::cout << to_json(score) << "\n";
  else
    std::cout << to_text(score) << page.string() << "\n";
  return kExitOk;
}

}  // namespace brachy
