#include "apps/daemon/control/read_scene.h"

#include <spdlog/spdlog.h>

#include <filesystem>

#include "core/scene/choice/choice.h"
#include "core/scene/file/scene_file.h"

namespace brachy {

Scene read_scene(const DaemonOptions& options) {
  Scene scene = options.config ? load_scene(*options.config) : Scene{};
  if (!options.simd.empty()) scene.engine.simd = options.simd;
  if (options.trajectory) scene.device.trajectory = std::filesystem::absolute(*options.trajectory).string();
  std::string choice;
  scene = with_choice(scene, &choice);
  if (!choice.empty()) spdlog::info("{}", choice);
  return scene;
}

}  // namespace brachy
