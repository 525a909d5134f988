#include "apps/brachyd/service/scene_changes.h"

#include <algorithm>

namespace brachy {
namespace {

struct Key {
  const char* name;
  bool (*is_same)(const Scene& a, const Scene& b);
  void (*take)(Scene& to, const Scene& from);  ///< null: it takes a restart
};

// Where something stands in its file is no difference.
bool same_regions(const Scene& a, const Scene& b) {
  return std::ranges::equal(a.regions, b.regions, [](RegionSettings x, const RegionSettings& y) {
    x.place = y.place;
    return x == y;
  });
}

bool same_structures(const Scene& a, const Scene& b) {
  return std::ranges::equal(a.structures, b.structures, [](StructureSettings x, const StructureSettings& y) {
    x.place = y.place;
    return x == y;
  });
}

#define LIVE(name, field)                                                    \
  Key {                                                                      \
    name, [](const Scene& a, const Scene& b) { return a.field == b.field; }, \
        [](Scene& to, const Scene& from) { to.field = from.field; }          \
  }
#define FIXED(name, field)                                                           \
  Key {                                                                              \
    name, [](const Scene& a, const Scene& b) { return a.field == b.field; }, nullptr \
  }

const std::vector<Key>& keys() {
  static const std::vector<Key> all = {
      LIVE("tissue.shear_modulus_kpa", tissue.shear_modulus_kpa),
      LIVE("tissue.poisson", tissue.poisson),
      LIVE("tissue.puncture_force_n", tissue.contact.puncture_force_n),
      LIVE("tissue.capsule_n_per_mm", tissue.contact.capsule_n_per_mm),
      LIVE("tissue.capsule_n_per_mm2", tissue.contact.capsule_n_per_mm2),
      LIVE("tissue.cutting_force_n", tissue.contact.cutting_force_n),
      LIVE("tissue.friction_n_per_mm", tissue.contact.friction_n_per_mm),
      LIVE("box.size_mm", box.size_mm),
      LIVE("box.centre_mm", box.centre_mm),
      LIVE("box.held", box.held),
      Key{"region", same_regions, [](Scene& to, const Scene& from) { to.regions = from.regions; }},
      LIVE("model.kernel", model.kernel),
      LIVE("model.support_radius_mm", model.support_radius_mm),
      LIVE("stability.policy", stability.policy),
      LIVE("stability.max_substeps", stability.max_substeps),
      LIVE("anchors.count", anchors.count),
      LIVE("anchors.lambda_rest", anchors.lambda_rest),
      LIVE("anchors.lambda_loaded", anchors.lambda_loaded),
      LIVE("anchors.relaxation_s", anchors.relaxation_s),
      LIVE("anchors.clearance_mm", anchors.clearance_mm),
      LIVE("anchors.seed", anchors.seed),
      LIVE("contact.tip_core_mm", contact.tip_core_mm),
      LIVE("contact.surface_slip_mm", contact.surface_slip_mm),
      LIVE("contact.landmark_spacing_mm", contact.landmark_spacing_mm),
      LIVE("contact.leave_path_mm", contact.leave_path_mm),
      LIVE("contact.max_displacement_mm", contact.max_displacement_mm),
      LIVE("contact.max_jump_mm", contact.max_jump_mm),
      LIVE("contact.max_landmarks", contact.max_landmarks),
      LIVE("engine.simd", engine.simd),
      LIVE("engine.threads", engine.threads),

      FIXED("name", name),
      FIXED("tissue.mesh", tissue.mesh),
      FIXED("tissue.units", tissue.units),
      FIXED("tissue.frame", tissue.frame),
      FIXED("tissue.points", tissue.points),
      FIXED("tissue.phantom_surface_vertices", tissue.phantom_surface_vertices),
      FIXED("tissue.phantom_size_mm", tissue.phantom_size_mm),
      FIXED("tissue.min_island_share", tissue.min_island_share),
      FIXED("tissue.weld_tolerance_mm", tissue.weld_tolerance_mm),
      FIXED("tissue.seed", tissue.seed),
      FIXED("needle.length_mm", needle.length_mm),
      FIXED("needle.diameter_mm", needle.diameter_mm),
      FIXED("needle.count", needle.count),
      FIXED("template.columns", template_grid.columns),
      FIXED("template.rows", template_grid.rows),
      FIXED("template.spacing_mm", template_grid.spacing_mm),
      FIXED("template.origin_mm", template_grid.origin_mm),
      FIXED("seeds.applicator", seeds.applicator),
      FIXED("seeds.source", seeds.source),
      FIXED("seeds.air_kerma_strength_u", seeds.air_kerma_strength_u),
      FIXED("seeds.max_count", seeds.max_count),
      FIXED("plan.file", plan_file),
      FIXED("dose.prescription_gy", dose.prescription_gy),
      FIXED("dose.spacing_mm", dose.spacing_mm),
      FIXED("dose.margin_mm", dose.margin_mm),
      Key{"structure", same_structures, nullptr},
      FIXED("rates.deformation_hz", rates.deformation_hz),
      FIXED("rates.snapshot_hz", rates.snapshot_hz),
      FIXED("realtime.fifo_priority", realtime.fifo_priority),
      FIXED("realtime.lock_memory", realtime.lock_memory),
      FIXED("realtime.control_thread", realtime.control_thread),
      FIXED("device.kind", device.kind),
      FIXED("device.trajectory", device.trajectory),
      FIXED("device.loop", device.loop),
      FIXED("device.centre_on_tissue", device.centre_on_tissue),
      FIXED("device.stale_pose_ms", device.stale_pose_ms),
      FIXED("server.address", server.address),
      FIXED("server.port", server.port),
      FIXED("server.http_port", server.http_port),
      FIXED("server.igtl_port", server.igtl_port),
      FIXED("server.token_file", server.token_file),
      FIXED("server.device_token_file", server.device_token_file),
      FIXED("server.viewer_token_file", server.viewer_token_file),
      FIXED("server.igtl_without_token", server.igtl_without_token),
      FIXED("server.tls_certificate", server.tls_certificate),
      FIXED("server.tls_key", server.tls_key),
      FIXED("server.tls_client_ca", server.tls_client_ca),
      FIXED("server.max_clients", server.max_clients),
      FIXED("server.max_clients_per_address", server.max_clients_per_address),
      FIXED("server.max_message_bytes", server.max_message_bytes),
      FIXED("server.max_poses_per_s", server.max_poses_per_s),
      FIXED("server.hello_timeout_ms", server.hello_timeout_ms),
      FIXED("server.silence_timeout_ms", server.silence_timeout_ms),
      FIXED("server.stall_timeout_ms", server.stall_timeout_ms),
      FIXED("broker.url", broker.url),
      FIXED("broker.session", broker.session),
      FIXED("broker.tls_ca", broker.tls_ca),
      FIXED("broker.tls_certificate", broker.tls_certificate),
      FIXED("broker.tls_key", broker.tls_key),
  };
  return all;
}

#undef LIVE
#undef FIXED

}  // namespace

SceneChanges changes_of(const Scene& in_use, const Scene& read) {
  SceneChanges changes{in_use, {}, {}};
  for (const Key& key : keys()) {
    if (key.is_same(in_use, read)) continue;
    (key.take ? changes.taken : changes.kept).emplace_back(key.name);
    if (key.take) key.take(changes.scene, read);
  }
  return changes;
}

std::vector<std::string> compared_keys() {
  std::vector<std::string> names;
  for (const Key& key : keys()) names.emplace_back(key.name);
  return names;
}

}  // namespace brachy
