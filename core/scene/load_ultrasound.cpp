#include "core/scene/load_ultrasound.h"

#include "core/geometry/volume/nrrd_file.h"

namespace brachy {

std::shared_ptr<const EchoMap> load_echo_map(const Scene& scene, const std::vector<Structure>& structures) {
  const UltrasoundSettings& s = scene.ultrasound;
  if (s.volume.empty()) return std::make_shared<const EchoMap>(structures, s.surroundings, s.seed);
  const NrrdVolume image = read_nrrd_file(scene.resolve(s.volume));
  return std::make_shared<const EchoMap>(structures, image.volume, s.volume_db_per_value);
}

UltrasoundImager::Options imager_options(const Scene& scene) {
  UltrasoundImager::Options options;
  options.settings = scene.ultrasound;
  options.probe_radius_mm = 0.5 * scene.probe.diameter_mm;
  options.rectal_wall_mm = scene.probe.rectal_wall_mm;
  options.needle_length_mm = scene.needle.length_mm;
  options.needle_radius_mm = 0.5 * scene.needle.diameter_mm;
  options.max_needles = scene.needle.count;
  options.max_seeds = static_cast<std::size_t>(scene.seeds.max_count);
  options.target = resolve_simd_target(scene.engine.simd);
  options.threads = scene.engine.threads;
  return options;
}

RigidTransform resting_probe(const Scene& scene, const Tissue& tissue) {
  Vec3 least = tissue.rest_vertices[0], most = least;
  for (std::size_t i = 0; i < tissue.surface_count; ++i) {
    least = least.cwiseMin(tissue.rest_vertices[i]);
    most = most.cwiseMax(tissue.rest_vertices[i]);
  }
  return resting_probe(scene.ultrasound, 0.5 * scene.probe.diameter_mm, scene.probe.rectal_wall_mm, least,
                       most);
}

}  // namespace brachy
