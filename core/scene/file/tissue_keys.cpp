#include <algorithm>
#include <array>
#include <limits>
#include <string_view>

#include "core/base/number_text.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

using enum Reload;
constexpr IntegerRange kSeedRange = {0, std::numeric_limits<std::int64_t>::max()};
constexpr Range kModulus = {1e-3, 1e6};
constexpr Range kSupport = {ModelSettings::kMinSupportMm, ModelSettings::kMaxSupportMm};

// [tissue] and [[region]]

std::vector<Key<TissueContact>> tissue_contact_keys() {
  using S = TissueContact;
  return {
      number("puncture_force_n", &S::puncture_force_n, {0, 100}, kLive,
             "the capsule ruptures at this force: prostate, 18 G, 5.6 ± 0.1 N (doi 10.31224/4646); 0: no "
             "capsule"),
      number("capsule_n_per_mm", &S::capsule_n_per_mm, {0, 1000}, kLive,
             "a1: indenting the capsule by d takes at most a1 d + a2 d² (Okamura, Simone, O'Leary 2004)"),
      number("capsule_n_per_mm2", &S::capsule_n_per_mm2, {0, 1000}, kLive,
             "a2; with a1 = 0.3 the indentation reaches 5.6 N at 7.5 mm"),
      number("cutting_force_n", &S::cutting_force_n, {0, 100}, kLive,
             "at the tip: with friction at 40 mm 79 % of the force, as Barnett 2015 measured (tearing 61 %, "
             "spreading 18 %)"),
      number("friction_n_per_mm", &S::friction_n_per_mm, {0, 1e6}, kLive,
             "along the shaft, per mm in the tissue: the other 21 %"),
  };
}

void check_tissue_contact(const TomlTable& t, const TissueContact& s) {
  if (s.puncture_force_n > 0 && s.capsule_n_per_mm <= 0 && s.capsule_n_per_mm2 <= 0)
    t.contradiction("capsule_n_per_mm",
                    "and capsule_n_per_mm2 are both 0: the capsule would never reach its "
                    "puncture_force_n; raise one of them");
}

std::vector<Key<TissueSettings>> tissue_keys() {
  using S = TissueSettings;
  std::vector<Key<S>> keys = {
      text("mesh", &S::mesh, {}, kRestart,
           "STL, OBJ or PLY file, relative to this file; empty: the generated phantom"),
      text("units", &S::units, {"mm", "m"}, kRestart,
           "of all mesh files of the scene: the tissue's, those of structures and of regions"),
      text("frame", &S::frame, {"RAS", "LPS"}, kRestart,
           "of all mesh files of the scene; one that states its own (3D Slicer's SPACE=LPS) is in that"),
      integer("points", &S::points, {4, 5'000'000}, kRestart,
              "surface and interior points; the interior is filled up to this number"),
      integer("phantom_surface_vertices", &S::phantom_surface_vertices, {100, 1'000'000}, kRestart,
              "of the generated phantom"),
      numbers("phantom_size_mm", &S::phantom_size_mm, {5, 1000}, kRestart, "its bounding box"),
      number("min_island_share", &S::min_island_share, {0, 0.5}, kRestart,
             "of the mesh file: islands below this share of the volume (debris) are removed"),
      number("weld_tolerance_mm", &S::weld_tolerance_mm, {0, 1}, kRestart,
             "of the mesh file: vertices closer than this are merged"),
      integer("seed", &S::seed, kSeedRange, kRestart, "of the random interior points"),
      number("shear_modulus_kpa", &S::shear_modulus_kpa, kModulus, kLive,
             "of tissue in no region: a third of the gland's Young's modulus, 17 kPa"),
      number("poisson", &S::poisson, {0, 0.4995}, kLive, "Poisson's ratio of all tissue"),
      text("colour", &S::colour, {}, kRestart,
           "#rrggbb, of the tissue in viewers that show no displacement or dose on it; empty: theirs"),
  };
  for (Key<S>& key : within<S>(
           tissue_contact_keys(), [](auto& s) -> auto& { return s.contact; }))
    keys.push_back(std::move(key));
  return keys;
}

void check_tissue(const TomlTable& t, Scene& scene) {
  const TissueSettings& s = scene.tissue;
  check_tissue_contact(t, s.contact);
  check_colour(t, s.colour);
  if (s.mesh.empty() && s.points < s.phantom_surface_vertices)
    t.contradiction("points", "is less than tissue.phantom_surface_vertices (" +
                                  std::to_string(s.phantom_surface_vertices) +
                                  "); raise one or lower the other");
}

// [box]

std::vector<Key<BoxSettings>> box_keys() {
  using S = BoxSettings;
  static const std::vector<std::string> faces(kFaceNames.begin(), kFaceNames.end());
  const auto read_held = [](TomlTable& t, std::array<bool, 6>& held) {
    std::vector<std::string> named;
    if (!t.texts("held", named, faces)) return;
    if (named.empty())
      t.contradiction("held", "is empty: a body that no face holds floats away; name a face");
    for (std::size_t f = 0; f < faces.size(); ++f) held[f] = std::ranges::count(named, faces[f]) > 0;
  };
  const auto write_held = [](const std::array<bool, 6>& held) {
    std::vector<std::string> named;
    for (std::size_t f = 0; f < faces.size(); ++f)
      if (held[f]) named.push_back(faces[f]);
    return toml_text(named);
  };
  return {
      numbers("size_mm", &S::size_mm, {1, 1e4}, kLive, "its edges"),
      numbers("centre_mm", &S::centre_mm, {-1e5, 1e5}, kLive, "its centre"),
      field_key("held", "list of texts", range_text(faces), &S::held, kLive,
                "faces that are fixed; the others are free", read_held, write_held),
  };
}

// [[region]]

// The keys that describe each shape.
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

std::vector<Key<RegionSettings>> region_keys() {
  using S = RegionSettings;
  std::vector<Key<S>> keys = {
      text("shape", &S::shape, {"ellipsoid", "sphere", "mesh"}, kLive,
           "an ellipsoid has centre_mm and semi_axes_mm, a sphere centre_mm and radius_mm, a mesh file"),
      numbers("centre_mm", &S::centre_mm, {-1e5, 1e5}, kLive, "of an ellipsoid or a sphere"),
      numbers("semi_axes_mm", &S::semi_axes_mm, {0.5, 1e4}, kLive, "of an ellipsoid, along x, y and z"),
      alternative<S>("radius_mm", Range{0.5, 1e4}, 20, kLive, "of a sphere",
                     [](const TomlTable&, S& s, double radius) { s.semi_axes_mm.setConstant(radius); }),
      text("file", &S::file, {}, kLive,
           "of a mesh: STL, OBJ or PLY, in tissue.units and tissue.frame, relative to this file"),
      number("shear_modulus_kpa", &S::shear_modulus_kpa, kModulus, kLive,
             "for compact_elastic, elastic and fem"),
      number("support_radius_mm", &S::support_radius_mm, kSupport, kLive,
             "psi kernels: how far a landmark in it reaches; compact_elastic: the largest support of its "
             "kernels"),
      number("blend_mm", &S::blend_mm, {0.1, 1000}, kLive,
             "width across its surface over which the support changes; a displacement over blend_mm / 2.4 "
             "folds there"),
  };
  for (const Key<TissueContact>& key : tissue_contact_keys()) {
    Key<S> of_region = within<S>(
        key, [](auto& s) -> auto& { return *s.contact; });
    of_region.written = [written = key.written](const S& s) { return s.contact ? written(*s.contact) : ""; };
    of_region.doc = "as in [tissue]" + std::string(std::string_view(key.name) == "puncture_force_n"
                                                       ? ", but 0 where the region does not have it"
                                                       : "");
    keys.push_back(std::move(of_region));
  }
  return keys;
}

void append_region(const TomlTable& t, Scene& scene) {
  RegionSettings& s = scene.regions.emplace_back();
  s.place = t.place();
  // What the region leaves open is as around it, but it has no capsule then.
  s.contact = scene.tissue.contact;
  s.contact->puncture_force_n = 0;
}

void append_example_region(Scene& scene) {
  RegionSettings& s = scene.regions.emplace_back();
  s.semi_axes_mm = {25, 20, 22};
  s.file = "gland.stl";
  s.shear_modulus_kpa = 12;
  s.support_radius_mm = 20;
  s.contact.emplace().puncture_force_n = 0;
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

void check_region(const TomlTable& t, Scene& scene) {
  RegionSettings& s = scene.regions.back();
  if (std::ranges::none_of(tissue_contact_keys(), [&](const auto& key) { return t.has(key.name); }))
    s.contact.reset();
  if (s.contact) check_tissue_contact(t, *s.contact);
  if (!t.has("shape")) t.missing("shape", "a [[region]] is an ellipsoid, a sphere or a mesh");
  check_shape(t, s.shape);
  if (!s.shear_modulus_kpa && !s.support_radius_mm && !s.contact)
    t.missing("shear_modulus_kpa",
              "a [[region]] has that, a support_radius_mm or forces of its own (cutting_force_n …)");
  if (!s.support_radius_mm && t.has("blend_mm"))
    t.contradiction("blend_mm", "belongs to region.support_radius_mm, which this region has not");
  // A wider transition would leave no part of the region with its own support.
  const double widest = 2 * s.semi_axes_mm.minCoeff();
  if (s.shape == "mesh" || s.blend_mm <= widest) return;
  if (t.has("blend_mm"))
    t.contradiction("blend_mm", "is wider than the region; lower it to at most " + text_of(widest));
  s.blend_mm = widest;
}

// [model]

Key<ModelSettings> kernel_key() {
  std::vector<std::string> kernels = all_model_names();
  kernels.emplace_back("auto");
  Key<ModelSettings> key = text("kernel", &ModelSettings::kernel, kernels, kLive,
                                "auto chooses a model by tolerance_mm, tick_budget_ms and needs");
  key.read = [read = key.read](TomlTable& t, ModelSettings& s) {
    std::string asked;
    t.text("kernel", asked);
    if (const std::string_view advice = retired_model_advice(asked); !advice.empty())
      t.contradiction("kernel", "is \"" + asked + "\", which " + std::string(advice));
    read(t, s);
  };
  return key;
}

std::vector<Key<ModelSettings>> model_keys() {
  using S = ModelSettings;
  return {
      kernel_key(),
      number("support_radius_mm", &S::support_radius_mm, kSupport, kLive,
             "psi kernels: how far a landmark reaches; at 12 mm a single landmark folds the field beyond 5.7 "
             "mm of displacement"),
      number(
          "tolerance_mm", &S::tolerance_mm, {1e-3, 100}, kIgnored,
          "auto: largest error in the gland at motions of up to 8 mm (`brachy advise` shows the candidates)"),
      number("tick_budget_ms", &S::tick_budget_ms, {1e-3, 1000}, kIgnored,
             "auto: longest tick, on one thread"),
      text("needs", &S::needs, {"volume", "surface"}, kIgnored,
           "auto: \"surface\" where no client uses the points inside"),
  };
}

void check_model(const TomlTable& t, Scene& scene) {
  const auto with_support = std::ranges::find_if(
      scene.regions, [](const RegionSettings& region) { return region.support_radius_mm.has_value(); });
  if (scene.model.kernel == "auto" && with_support != scene.regions.end())
    t.contradiction("kernel",
                    "is \"auto\", which is charted for one support only; name a model, or take "
                    "region.support_radius_mm out of " +
                        with_support->place);
}

// [stability]

std::vector<Key<GuardSettings>> stability_keys() {
  using S = GuardSettings;
  return {
      text("policy", &S::policy, {"flag", "clamp", "substep"}, kLive,
           "report it; clamp the landmarks; or compose injective sub-steps (psi kernels, elastic, fem)"),
      integer("max_substeps", &S::max_substeps, {1, 64}, kLive,
              "beyond this number, and with the other models, \"substep\" acts as \"clamp\""),
  };
}

// [anchors]

std::vector<Key<Anchors::Options>> anchors_keys() {
  using S = Anchors::Options;
  return {
      integer("count", &S::count, {0, 64}, kLive, "number of anchors; 0: none"),
      number("lambda_rest", &S::lambda_rest, {0.01, 0.99}, kLive, "scale factor at rest"),
      number("lambda_loaded", &S::lambda_loaded, {0.01, 0.99}, kLive,
             "scale factor under full load, at most lambda_rest, which is its default: anchors do not move"),
      number("relaxation_s", &S::relaxation_s, {0.001, 100}, kLive, "time from one to the other"),
      number("clearance_mm", &S::clearance_mm, {0, 100}, kLive,
             "an anchor this close to a needle's line is moved aside"),
      integer("seed", &S::seed, kSeedRange, kLive, "of the random choice of surface points"),
  };
}

void check_anchors(const TomlTable& t, Scene& scene) {
  Anchors::Options& s = scene.anchors;
  if (!t.has("lambda_loaded")) s.lambda_loaded = s.lambda_rest;
  if (s.lambda_loaded > s.lambda_rest)
    t.contradiction("lambda_loaded", "must not exceed anchors.lambda_rest (" + text_of(s.lambda_rest) +
                                         "): anchors retreat under load");
}

}  // namespace

std::vector<SceneSection> tissue_sections() {
  return {
      {"tissue",
       "The tissue and what an 18 G needle meets in it, here and at the outer surface; the forces of other "
       "gauges are in proportion to their diameter.",
       within<Scene>(
           tissue_keys(), [](auto& s) -> auto& { return s.tissue; }),
       check_tissue},
      {"box", "The box that holds the tissue, for compact_elastic, elastic and fem.",
       within<Scene>(
           box_keys(), [](auto& s) -> auto& { return s.box; })},
      {"region",
       "A part of the tissue with a modulus (elastic, fem), a support (psi kernels "
       "and compact_elastic: up to 15 different ones) or needle forces of its own. A later region lies over "
       "an earlier one.",
       within<Scene>(
           region_keys(), [](auto& s) -> auto& { return s.regions.back(); }),
       check_region,
       SceneSection::List{list_key("region", &Scene::regions, kLive), append_region, append_example_region}},
      {"model", "The deformation model.",
       within<Scene>(
           model_keys(), [](auto& s) -> auto& { return s.model; }),
       check_model},
      {"stability",
       "The injectivity guard: each tick's field is certified. policy is for landmarks that would "
       "fold it.",
       within<Scene>(
           stability_keys(), [](auto& s) -> auto& { return s.stability; })},
      {"anchors", "Landmarks with displacement 0: surface points scaled about the centroid.",
       within<Scene>(
           anchors_keys(), [](auto& s) -> auto& { return s.anchors; }),
       check_anchors},
  };
}

}  // namespace brachy
