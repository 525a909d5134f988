#include "core/scene/scene_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include "core/error.h"
#include "core/ladder/ladder.h"
#include "core/scene/implant_keys.h"
#include "core/scene/toml_table.h"

namespace brachy {
namespace {

constexpr std::uintmax_t kMaxSceneBytes = 1 << 20;

void read_contact_of_tissue(TomlTable& t, TissueContact& s) {
  t.number("puncture_force_n", s.puncture_force_n, 0, 100);
  t.number("capsule_n_per_mm", s.capsule_n_per_mm, 0, 1000);
  t.number("capsule_n_per_mm2", s.capsule_n_per_mm2, 0, 1000);
  t.number("cutting_force_n", s.cutting_force_n, 0, 100);
  t.number("friction_n_per_mm", s.friction_n_per_mm, 0, 1e6);
  if (s.puncture_force_n > 0 && s.capsule_n_per_mm <= 0 && s.capsule_n_per_mm2 <= 0)
    t.contradiction("capsule_n_per_mm",
                    "and capsule_n_per_mm2 are both 0: the capsule would never reach its "
                    "puncture_force_n; raise one of them");
}

void read_tissue(TomlTable t, TissueSettings& s) {
  t.text("mesh", s.mesh);
  t.text("units", s.units, {"mm", "m"});
  t.text("frame", s.frame, {"RAS", "LPS"});
  t.integer("points", s.points, 4, 5'000'000);
  t.integer("phantom_surface_vertices", s.phantom_surface_vertices, 100, 1'000'000);
  t.numbers("phantom_size_mm", s.phantom_size_mm, 5, 1000);
  t.number("min_island_share", s.min_island_share, 0, 0.5);
  t.number("weld_tolerance_mm", s.weld_tolerance_mm, 0, 1);
  t.integer("seed", s.seed, 0, std::numeric_limits<std::int64_t>::max());
  t.number("shear_modulus_kpa", s.shear_modulus_kpa, 1e-3, 1e6);
  t.number("poisson", s.poisson, 0, 0.4995);
  read_contact_of_tissue(t, s.contact);
  t.refuse_unknown();
  if (s.mesh.empty() && s.points < s.phantom_surface_vertices)
    t.contradiction("points", "is less than tissue.phantom_surface_vertices (" +
                                  std::to_string(s.phantom_surface_vertices) +
                                  "); raise one or lower the other");
}

void read_model(TomlTable t, const std::vector<RegionSettings>& regions, ModelSettings& s) {
  std::vector<std::string> kernels = rung_names();
  kernels.emplace_back("auto");
  t.text("kernel", s.kernel, kernels);
  t.number("tolerance_mm", s.tolerance_mm, 1e-3, 100);
  t.number("tick_budget_ms", s.tick_budget_ms, 1e-3, 1000);
  t.text("needs", s.needs, {"volume", "surface"});
  t.number("support_radius_mm", s.support_radius_mm, ModelSettings::kMinSupportMm,
           ModelSettings::kMaxSupportMm);
  t.refuse_unknown();
  const auto with_support = std::ranges::find_if(
      regions, [](const RegionSettings& region) { return region.support_radius_mm.has_value(); });
  if (s.kernel == "auto" && with_support != regions.end())
    t.contradiction("kernel",
                    "is \"auto\", which is charted for one support only; name a rung, or take "
                    "region.support_radius_mm out of " +
                        with_support->place);
}

void read_box(TomlTable t, BoxSettings& s) {
  t.numbers("size_mm", s.size_mm, 1, 1e4);
  t.numbers("centre_mm", s.centre_mm, -1e5, 1e5);
  const std::vector<std::string> faces(kFaceNames.begin(), kFaceNames.end());
  std::vector<std::string> held;
  if (t.texts("held", held, faces)) {
    if (held.empty()) t.contradiction("held", "is empty: a body that nothing holds floats away; name a face");
    for (std::size_t f = 0; f < faces.size(); ++f)
      s.held[f] = std::find(held.begin(), held.end(), faces[f]) != held.end();
  }
  t.refuse_unknown();
}

// What each shape is given by.
struct ShapeKeys {
  const char* shape;
  std::vector<const char*> keys;
  const char* what;
};
const std::vector<ShapeKeys>& shapes() {
  static const std::vector<ShapeKeys> all = {
      {"ellipsoid", {"centre_mm", "semi_axes_mm"}, "an ellipsoid has centre_mm and semi_axes_mm"},
      {"sphere", {"centre_mm", "radius_mm"}, "a sphere has centre_mm and radius_mm"},
      {"mesh",
       {"file"},
       "a region of shape \"mesh\" names its STL, OBJ or PLY file, and lies where that says"}};
  return all;
}

void check_shape(const TomlTable& t, const std::string& shape) {
  const auto mine = std::ranges::find(shapes(), shape, &ShapeKeys::shape);
  for (const char* key : mine->keys)
    if (!t.has(key)) t.missing(key, mine->what);
  for (const ShapeKeys& other : shapes())
    for (const char* key : other.keys)
      if (t.has(key) && std::ranges::find(mine->keys, std::string_view(key)) == mine->keys.end())
        t.contradiction(key, "belongs to shape = \"" + std::string(other.shape) + "\"; " + mine->what);
}

void optional_number(TomlTable& t, const char* key, std::optional<double>& value, double least, double most) {
  double v = 0;
  t.number(key, v, least, most);
  if (t.has(key)) value = v;
}

void read_contact_of_region(TomlTable& t, const TissueContact& around, RegionSettings& s) {
  TissueContact contact = around;
  contact.puncture_force_n = 0;
  read_contact_of_tissue(t, contact);
  for (const char* key :
       {"puncture_force_n", "capsule_n_per_mm", "capsule_n_per_mm2", "cutting_force_n", "friction_n_per_mm"})
    if (t.has(key)) s.contact = contact;
}

void read_region(TomlTable t, const TissueContact& around, RegionSettings& s) {
  s.place = t.place();
  t.text("shape", s.shape, {"ellipsoid", "sphere", "mesh"});
  t.numbers("centre_mm", s.centre_mm, -1e5, 1e5);
  t.numbers("semi_axes_mm", s.semi_axes_mm, 0.5, 1e4);
  double radius = s.semi_axes_mm[0];
  t.number("radius_mm", radius, 0.5, 1e4);
  t.text("file", s.file);
  optional_number(t, "shear_modulus_kpa", s.shear_modulus_kpa, 1e-3, 1e6);
  optional_number(t, "support_radius_mm", s.support_radius_mm, ModelSettings::kMinSupportMm,
                  ModelSettings::kMaxSupportMm);
  t.number("blend_mm", s.blend_mm, 0.1, 1000);
  read_contact_of_region(t, around, s);
  t.refuse_unknown();
  if (!t.has("shape")) t.missing("shape", "a [[region]] is an ellipsoid, a sphere or a mesh");
  check_shape(t, s.shape);
  if (s.shape == "sphere") s.semi_axes_mm.setConstant(radius);
  if (!s.shear_modulus_kpa && !s.support_radius_mm && !s.contact)
    t.missing("shear_modulus_kpa",
              "a [[region]] has that, a support_radius_mm or forces of its own (cutting_force_n …)");
  if (!s.support_radius_mm && t.has("blend_mm"))
    t.contradiction("blend_mm", "belongs to region.support_radius_mm, which this region has not");
  // Wider, and the middle would not be the region's own.
  const double widest = 2 * s.semi_axes_mm.minCoeff();
  if (s.shape == "mesh" || s.blend_mm <= widest) return;
  if (t.has("blend_mm"))
    t.contradiction("blend_mm", "is wider than the region; lower it to at most " + text_of(widest));
  s.blend_mm = widest;
}

void read_stability(TomlTable t, GuardSettings& s) {
  t.text("policy", s.policy, {"flag", "clamp", "substep"});
  t.integer("max_substeps", s.max_substeps, 1, 64);
  t.refuse_unknown();
}

void read_anchors(TomlTable t, Anchors::Options& s) {
  t.integer("count", s.count, 0, 64);
  t.number("lambda_rest", s.lambda_rest, 0.01, 0.99);
  s.lambda_loaded = s.lambda_rest;
  t.number("lambda_loaded", s.lambda_loaded, 0.01, 0.99);
  t.number("relaxation_s", s.relaxation_s, 0.001, 100);
  t.number("clearance_mm", s.clearance_mm, 0, 100);
  t.integer("seed", s.seed, 0, std::numeric_limits<std::int64_t>::max());
  t.refuse_unknown();
  if (s.lambda_loaded > s.lambda_rest)
    t.contradiction("lambda_loaded", "must not exceed anchors.lambda_rest (" + text_of(s.lambda_rest) +
                                         "): anchors retreat under load");
}

// Outer diameters of regular-wall needles, mm (ISO 9626).
constexpr std::array<std::pair<int, double>, 12> kGauges = {{{14, 2.11},
                                                             {15, 1.83},
                                                             {16, 1.65},
                                                             {17, 1.47},
                                                             {18, NeedleSettings::kReferenceDiameter},
                                                             {19, 1.07},
                                                             {20, 0.91},
                                                             {21, 0.82},
                                                             {22, 0.72},
                                                             {23, 0.64},
                                                             {24, 0.57},
                                                             {25, 0.51}}};

void read_gauge(TomlTable& t, NeedleSettings& s) {
  int gauge = 18;
  t.integer("gauge", gauge, kGauges.front().first, kGauges.back().first);
  if (!t.has("gauge")) return;
  const double diameter = kGauges[static_cast<std::size_t>(gauge - kGauges.front().first)].second;
  if (t.has("diameter_mm") && s.diameter_mm != diameter)
    t.contradiction("gauge",
                    "is " + text_of(diameter) + " mm and needle.diameter_mm another; give one of them");
  s.diameter_mm = diameter;
}

void read_needle(TomlTable t, NeedleSettings& s) {
  t.number("length_mm", s.length_mm, 10, 500);
  t.integer("count", s.count, 1, NeedleSettings::kMaxCount);
  t.number("diameter_mm", s.diameter_mm, 0.1, 10);
  read_gauge(t, s);
  if (double radius = 0.5 * s.diameter_mm; t.has("radius_mm")) {
    t.number("radius_mm", radius, 0.05, 5);
    if ((t.has("diameter_mm") || t.has("gauge")) && radius != 0.5 * s.diameter_mm)
      t.contradiction("radius_mm",
                      "is not half of needle.diameter_mm (" + text_of(s.diameter_mm) + "); give one of them");
    s.diameter_mm = 2 * radius;
  }
  t.refuse_unknown();
}

void read_contact(TomlTable t, ContactSettings& s, double needle_length_mm) {
  t.number("tip_core_mm", s.tip_core_mm, 0.1, 100);
  t.number("surface_slip_mm", s.surface_slip_mm, 0, 50);
  t.number("landmark_spacing_mm", s.landmark_spacing_mm, 0.5, 50);
  t.number("leave_path_mm", s.leave_path_mm, 0.1, 50);
  t.number("max_displacement_mm", s.max_displacement_mm, 0.1, 100);
  t.number("max_jump_mm", s.max_jump_mm, 0.1, 1000);
  t.integer("max_landmarks", s.max_landmarks, 2, 100);
  t.refuse_unknown();
  if (s.landmark_spacing_mm * (s.max_landmarks - 1) < needle_length_mm)
    t.contradiction(
        "max_landmarks",
        "(" + std::to_string(s.max_landmarks) +
            ") at contact.landmark_spacing_mm = " + text_of(s.landmark_spacing_mm) +
            " does not cover the needle of " + text_of(needle_length_mm) + " mm; set it to at least " +
            text_of(std::ceil(needle_length_mm / s.landmark_spacing_mm) + 1) + " or widen the spacing");
}

void read_device(TomlTable t, DeviceSettings& s) {
  t.text("kind", s.kind, {"network", "scripted"});
  t.text("trajectory", s.trajectory);
  t.flag("loop", s.loop);
  t.flag("centre_on_tissue", s.centre_on_tissue);
  t.number("stale_pose_ms", s.stale_pose_ms, 1, 60000);
  t.refuse_unknown();
  if (s.kind == "scripted" && s.trajectory.empty())
    t.contradiction("kind", "is \"scripted\" and needs device.trajectory = \"FILE.csv\"");
}

void read_server(TomlTable t, ServerSettings& s) {
  t.text("address", s.address);
  t.integer("port", s.port, 0, 65535);
  t.integer("http_port", s.http_port, -1, 65535);
  t.integer("igtl_port", s.igtl_port, -1, 65535);
  t.text("token_file", s.token_file);
  t.text("device_token_file", s.device_token_file);
  t.text("viewer_token_file", s.viewer_token_file);
  t.flag("igtl_without_token", s.igtl_without_token);
  t.text("tls_certificate", s.tls_certificate);
  t.text("tls_key", s.tls_key);
  t.text("tls_client_ca", s.tls_client_ca);
  t.integer("max_clients", s.max_clients, 1, 1024);
  t.integer("max_clients_per_address", s.max_clients_per_address, 1, 1024);
  t.integer("max_message_bytes", s.max_message_bytes, 256, 16 << 20);
  t.number("max_poses_per_s", s.max_poses_per_s, 1, 100000);
  t.integer("hello_timeout_ms", s.hello_timeout_ms, 100, 60'000);
  t.integer("silence_timeout_ms", s.silence_timeout_ms, 1500, 600'000);  // clients are asked every second
  t.integer("stall_timeout_ms", s.stall_timeout_ms, 100, 600'000);
  t.refuse_unknown();
  if (s.tls_certificate.empty() != s.tls_key.empty())
    t.contradiction(s.tls_key.empty() ? "tls_certificate" : "tls_key",
                    std::string("needs server.") + (s.tls_key.empty() ? "tls_key" : "tls_certificate") +
                        " = \"FILE.pem\" beside it");
  if (!s.tls_client_ca.empty() && s.tls_certificate.empty())
    t.contradiction("tls_client_ca", "needs TLS: give server.tls_certificate and server.tls_key");
}

void read_broker(TomlTable t, BrokerSettings& s) {
  t.text("url", s.url);
  t.text("session", s.session);
  t.text("tls_ca", s.tls_ca);
  t.text("tls_certificate", s.tls_certificate);
  t.text("tls_key", s.tls_key);
  t.refuse_unknown();
}

void read_rates(TomlTable t, RateSettings& s) {
  t.number("deformation_hz", s.deformation_hz, 1, 1000);
  t.number("snapshot_hz", s.snapshot_hz, 1, 120);
  t.refuse_unknown();
}

void read_engine(TomlTable t, EngineSettings& s) {
  t.text("simd", s.simd, {"auto", "generic", "sse4", "avx2", "avx512"});
  t.integer("threads", s.threads, 1, 64);
  t.refuse_unknown();
}

void read_realtime(TomlTable t, RealtimeSettings& s) {
  t.integer("fifo_priority", s.fifo_priority, 0, 99);
  t.flag("lock_memory", s.lock_memory);
  t.flag("control_thread", s.control_thread);
  t.refuse_unknown();
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name) {
  Scene scene;
  const toml::table root = parse_toml(text, name);
  TomlTable top(&root, "", name);
  top.text("name", scene.name);
  read_tissue(top.table("tissue"), scene.tissue);
  read_box(top.table("box"), scene.box);
  for (TomlTable& region : top.tables("region"))
    read_region(region, scene.tissue.contact, scene.regions.emplace_back());
  read_model(top.table("model"), scene.regions, scene.model);
  read_stability(top.table("stability"), scene.stability);
  read_anchors(top.table("anchors"), scene.anchors);
  read_needle(top.table("needle"), scene.needle);
  read_contact(top.table("contact"), scene.contact, scene.needle.length_mm);
  read_implant(top, scene);
  read_rates(top.table("rates"), scene.rates);
  read_engine(top.table("engine"), scene.engine);
  read_realtime(top.table("realtime"), scene.realtime);
  read_device(top.table("device"), scene.device);
  read_server(top.table("server"), scene.server);
  read_broker(top.table("broker"), scene.broker);
  top.refuse_unknown();
  return scene;
}

Scene load_scene(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(
        name + ": no such scene file; give one with --config (config/prostate.toml is the default scene)");
  if (std::filesystem::file_size(file, error) > kMaxSceneBytes)
    throw UserError(name + ": larger than 1 MiB; a scene file is a page of TOML");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(name + ": cannot be read; check its permissions");
  Scene scene = parse_scene(text.str(), name);
  scene.directory = file.parent_path();
  return scene;
}

}  // namespace brachy
