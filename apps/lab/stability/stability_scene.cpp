#include "apps/lab/stability/stability_scene.h"

#include "core/models/matrix_kernel/matrix_models.h"
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

std::vector<std::string> StabilityScene::models() const {
  std::vector<std::string> models;
  for (const std::string& model_name : all_model_names())
    if (is_matrix_model(model_name) && (model_name != "elastic" || body_.regions.size() <= 1))
      models.push_back(model_name);
  return models;
}

const MatrixKernel& StabilityScene::kernel(const std::string& model_name) {
  auto& kernel = kernels_[model_name];
  if (!kernel) kernel = make_matrix_kernel(model_name, body_);
  return *kernel;
}

}  // namespace brachy
