#include "apps/score/report.h"

#include <fstream>

#include "core/base/error.h"
#include "core/scene/load_structures.h"

namespace brachy {
namespace {

void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw UserError(file.string() + ": cannot be written; check the folder and the free space");
}

}  // namespace

Score write_report(const std::filesystem::path& folder, const Plan& plan, const Scene& scene,
                   const std::filesystem::path& html, const std::function<void(double share)>& progress) {
  const Recording recording = load_recording(folder);
  const std::vector<Structure> structures = load_structures(scene);
  Score score = score_session(plan, scene.template_grid, structures, scene.dose, recording, progress);
  write(html, to_html(score, plan, scene.template_grid, structures));
  write(std::filesystem::path(html).replace_extension(".json"), to_json(score) + "\n");
  return score;
}

}  // namespace brachy
