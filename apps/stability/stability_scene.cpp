#include "apps/stability/stability_scene.h"

#include "core/ladder/ladder.h"
#include "core/scene/load_body.h"
#include "core/scene/load_tissue.h"

namespace brachy {

StabilityScene::StabilityScene(const Scene& scene, bool is_quick)
    : body_(load_body(scene)),
      support_(scene.model.support_radius_mm),
      spacing_(scene.contact.landmark_spacing_mm),
      surface_(load_surface(scene).mesh.vertices),
      anchors_(surface_, scene.anchors),
      is_quick_(is_quick) {}

std::vector<std::string> StabilityScene::rungs() const {
  std::vector<std::string> rungs;
  for (const std::string& rung : rung_names())
    if (is_matrix_rung(rung) && (rung != "elastic" || body_.regions.size() <= 1)) rungs.push_back(rung);
  return rungs;
}

const MatrixKernel& StabilityScene::kernel(const std::string& rung) {
  auto& kernel = kernels_[rung];
  if (!kernel) kernel = make_matrix_kernel(rung, body_);
  return *kernel;
}

}  // namespace brachy
