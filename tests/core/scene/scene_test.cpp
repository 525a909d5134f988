#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/error.h"
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
