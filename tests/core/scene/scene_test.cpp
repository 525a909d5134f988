#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "core/scene/load_body.h"
#include "core/scene/load_tissue.h"
#include "core/scene/scene_file.h"

namespace brachy {
namespace {

std::string refusal(const std::string& text) {
  try {
    parse_scene(text, "scene.toml");
  } catch (const UserError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return "accepted";
}

TEST(Scene, TheDefaultFileSaysTheDefaults) {
  const Scene file = load_scene(BRACHY_SOURCE_DIR "/config/prostate.toml");
  const Scene built_in = parse_scene("", "nothing");
  EXPECT_EQ(file.name, built_in.name);
  EXPECT_EQ(file.tissue, built_in.tissue);
  EXPECT_EQ(file.box, built_in.box);
  EXPECT_EQ(file.regions, built_in.regions);
  EXPECT_EQ(file.model, built_in.model);
  EXPECT_EQ(file.anchors, built_in.anchors);
  EXPECT_EQ(file.needle, built_in.needle);
  EXPECT_EQ(file.contact, built_in.contact);
  EXPECT_EQ(file.rates, built_in.rates);
  EXPECT_EQ(file.engine, built_in.engine);
  EXPECT_EQ(file.realtime, built_in.realtime);
  EXPECT_EQ(file.device, built_in.device);
  EXPECT_EQ(file.server, built_in.server);
}

TEST(Scene, UnknownKeysAreRefusedWithLineAndNearestName) {
  EXPECT_EQ(refusal("[model]\nkernel = \"psi31\"\nsuport_radius_mm = 12\n"),
            "scene.toml:3: unknown key 'model.suport_radius_mm'; did you mean 'model.support_radius_mm'?");
  EXPECT_EQ(refusal("\n[modle]\n"), "scene.toml:2: unknown key 'modle'; did you mean 'model'?");
}

TEST(Scene, ABodyIsReadAsAReferenceSceneSaysIt) {
  const Scene scene = load_scene(BRACHY_SOURCE_DIR "/tests/reference/free_face_stiff_lateral/scene.toml");
  EXPECT_EQ(scene.box.size_mm, Vec3(96, 96, 96));
  EXPECT_EQ(scene.box.held, (std::array<bool, 6>{true, true, true, true, false, true}));
  ASSERT_EQ(scene.regions.size(), 1u);
  EXPECT_EQ(scene.regions[0].semi_axes_mm, Vec3(24, 18, 21));
  EXPECT_EQ(scene.needle.diameter_mm, 4);
  const ElasticBody body = load_body(scene);
  EXPECT_DOUBLE_EQ(body.shear_modulus, 1e-3 * scene.tissue.shear_modulus_kpa);
  EXPECT_DOUBLE_EQ(body.materials().at(1), 3);
  EXPECT_EQ(body.needle_radius, 2);
}

TEST(Scene, SaysWhatGuardsAgainstFolds) {
  EXPECT_EQ(parse_scene("", "scene.toml").stability.policy, "substep");
  const Scene scene = parse_scene("[stability]\npolicy = \"clamp\"\nmax_substeps = 3", "scene.toml");
  EXPECT_EQ(scene.stability.policy, "clamp");
  EXPECT_EQ(scene.stability.max_substeps, 3);
  EXPECT_NE(refusal("[stability]\npolicy = \"hope\"").find("scene.toml:2: 'stability.policy'"),
            std::string::npos);
  EXPECT_NE(refusal("[stability]\nmax_substeps = 0").find("scene.toml:2: 'stability.max_substeps'"),
            std::string::npos);
}

TEST(Scene, ABodyThatMakesNoSenseIsRefused) {
  const std::string ellipsoid = "[[region]]\nshape = \"ellipsoid\"\nshear_modulus_kpa = 2\n";
  EXPECT_NE(refusal(ellipsoid).find("scene.toml:1: 'region.centre_mm' is missing"), std::string::npos);
  EXPECT_NE(refusal("[[region]]\nshape = \"mesh\"\nshear_modulus_kpa = 2").find("'region.file' is missing"),
            std::string::npos);
  EXPECT_NE(refusal("[box]\nheld = [\"-x\", \"up\"]").find("scene.toml:2: 'box.held' has \"up\""),
            std::string::npos);
  EXPECT_NE(refusal("[box]\nheld = []").find("is empty"), std::string::npos);
  EXPECT_NE(refusal("[box]\nsize_mm = [1, 2]").find("needs three numbers"), std::string::npos);
  EXPECT_NE(refusal("[needle]\ndiameter_mm = 2\nradius_mm = 2").find("is not half of"), std::string::npos);
  const Scene far =
      parse_scene(ellipsoid + "centre_mm = [40, 0, 0]\nsemi_axes_mm = [10, 10, 10]", "scene.toml");
  EXPECT_THROW(load_body(far), UserError);
}

TEST(Scene, ValuesOutOfRangeAreRefusedWithTheRange) {
  EXPECT_EQ(refusal("[model]\nsupport_radius_mm = -3"),
            "scene.toml:2: 'model.support_radius_mm' is -3; it must be between 0.5 and 500");
  EXPECT_NE(refusal("[rates]\ndeformation_hz = nan").find("must be between 1 and 1000"), std::string::npos);
  EXPECT_NE(refusal("[tissue]\npoints = 99999999999").find("it must be between"), std::string::npos);
}

TEST(Scene, WrongTypesAreRefused) {
  EXPECT_NE(refusal("[model]\nkernel = 31").find("scene.toml:2: 'model.kernel' needs a text"),
            std::string::npos);
  EXPECT_NE(refusal("[tissue]\npoints = 1.5").find("needs a whole number"), std::string::npos);
  EXPECT_NE(refusal("[device]\nloop = 1").find("needs true or false"), std::string::npos);
  EXPECT_NE(refusal("model = 3").find("needs to be a table"), std::string::npos);
  EXPECT_NE(refusal("[model]\nkernel = \"psi33\"").find("one of: psi31, psi30, psi32, buhmann"),
            std::string::npos);
}

TEST(Scene, SettingsThatContradictEachOtherAreRefused) {
  EXPECT_NE(refusal("[contact]\nlandmark_spacing_mm = 2").find("set it to at least 101"), std::string::npos);
  EXPECT_NE(refusal("[device]\nkind = \"scripted\"").find("needs device.trajectory"), std::string::npos);
  EXPECT_NE(refusal("[anchors]\nlambda_loaded = 0.6").find("must not exceed"), std::string::npos);
  EXPECT_NE(refusal("[tissue]\npoints = 1000").find("phantom_surface_vertices"), std::string::npos);
}

TEST(Scene, TextThatIsNotTomlIsRefusedWithItsLine) {
  EXPECT_EQ(refusal("[model]\nkernel = \"psi31\n").find("scene.toml:2: not valid TOML"), 0u);
  EXPECT_EQ(refusal(std::string("\0\xff\xfe", 3)).find("scene.toml:1: not valid TOML"), 0u);
}

TEST(Scene, AnyTruncationOfTheDefaultFileIsAcceptedOrRefusedInOneLine) {
  std::ifstream in(BRACHY_SOURCE_DIR "/config/prostate.toml");
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  ASSERT_GT(text.size(), 1000u);
  for (std::size_t n = 0; n < text.size(); ++n) refusal(text.substr(0, n));
}

TEST(Scene, AMissingFileIsRefusedByName) {
  EXPECT_THROW(load_scene("/nonexistent/scene.toml"), UserError);
  EXPECT_THROW(load_scene("/tmp"), UserError);
}

TEST(Scene, MeshFilesAreFoundBesideTheScene) {
  Scene scene;
  scene.directory = "/nonexistent";
  scene.tissue.mesh = "gland.stl";
  try {
    load_tissue(scene);
    FAIL();
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("/nonexistent/gland.stl"), std::string::npos);
  }
}

}  // namespace
}  // namespace brachy
