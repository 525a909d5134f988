#include "core/scene/choose_source.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/scene/file/scene_file.h"
#include "test_paths.h"

namespace brachy {
namespace {

Scene chosen(const std::string& text) {
  Scene scene = parse_scene(text, "scene.toml");
  scene.directory = BRACHY_SOURCE_DIR "/config";
  choose_source(scene);
  return scene;
}

TEST(ChooseSource, TakesANameOrAFileBesideTheScene) {
  EXPECT_EQ(chosen("[seeds]\nsource = \"200\"\n").seeds.source, SourceModel::kTheraSeed200);
  EXPECT_EQ(chosen("[dose]\nsource = \"cs1-rev2\"\n").seeds.source, SourceModel::kIsoRayCs1);
  EXPECT_EQ(chosen("[dose]\nsource = \"sources/cs1-rev2.toml\"\n").seeds.source, SourceModel::kIsoRayCs1);
  EXPECT_EQ(chosen("[implant]\nkind = \"hdr\"\n").seeds.source, SourceModel::kMicroSelectronV2);
}

TEST(ChooseSource, RefusesASourceOfTheOtherKind) {
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      chosen(text);
    } catch (const UserError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal("[dose]\nsource = \"mhdr-v2\"\n"),
            "dose.source is \"mhdr-v2\", a source that is withdrawn again, and implant.kind is \"ldr\"; use "
            "one of: 6711, "
            "200, cs1-rev2");
  EXPECT_EQ(refusal("[implant]\nkind = \"hdr\"\n[dose]\nsource = \"6711\"\n"),
            "dose.source is \"6711\", a seed that stays, and implant.kind is \"hdr\"; use one of: "
            "mhdr-v2, gammamed-hdr, flexisource, spec-m-19"
            ", vs2000, varisource, gammamed-pdr");
  EXPECT_NE(refusal("[dose]\nsource = \"none.toml\"\n").find("none.toml: no such source file"),
            std::string::npos);
}

}  // namespace
}  // namespace brachy
