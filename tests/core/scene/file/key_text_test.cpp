#include "core/scene/file/key_text.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "core/scene/file/scene_file.h"
#include "core/scene/file/scene_keys.h"
#include "test_paths.h"

namespace brachy {
namespace {

/// With BRACHY_WRITE_KEYS set (scripts/scene_keys.sh), writes the file first.
void expect_generated(const std::string& path, const std::string& text) {
  const std::string file = std::string(BRACHY_SOURCE_DIR "/") + path;
  if (std::getenv("BRACHY_WRITE_KEYS") != nullptr) std::ofstream(file, std::ios::binary) << text;
  std::ifstream in(file, std::ios::binary);
  const std::string stored((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(stored, text) << path
                          << " is not what the keys in core/scene/file generate: run scripts/scene_keys.sh";
}

TEST(KeyText, TheDefaultSceneIsGenerated) {
  expect_generated("config/prostate.toml", default_scene_toml());
}

TEST(KeyText, TheTableOfKeysIsGenerated) {
  expect_generated("config/KEYS.md", scene_keys_markdown());
}

TEST(KeyText, TheDefaultSceneReadsAsTheBuiltInOne) {
  EXPECT_EQ(parse_scene(default_scene_toml(), "prostate.toml"), Scene{});
}

TEST(KeyText, TheExamplesOfListsCanBeRead) {
  Scene example;
  for (const SceneSection& section : scene_sections()) {
    if (!section.list) continue;
    section.list->append_example(example);
    std::string text = "[[" + std::string(section.name) + "]]\n";
    for (const Key<Scene>& key : section.keys) {
      const std::set<std::string> of_other_shapes = {"radius_mm"};
      const bool is_of_mesh = std::string(section.name) == "region" && std::string(key.name) == "file";
      if (is_of_mesh || of_other_shapes.contains(key.name)) continue;
      text += std::string(key.name) + " = " + key.written(example) + "\n";
    }
    EXPECT_NO_THROW(parse_scene(text, "example.toml")) << text;
  }
}

TEST(KeyText, EachKeyHasAMeaningAndAppearsOnce) {
  std::set<std::string> names;
  for (const SceneSection& section : scene_sections())
    for (const Key<Scene>& key : section.keys) {
      const std::string name = std::string(section.name) + "." + key.name;
      EXPECT_TRUE(names.insert(name).second) << name;
      EXPECT_FALSE(key.doc.empty()) << name;
    }
  EXPECT_GT(names.size(), 100u);
}

TEST(KeyText, AUnitIsTheNamesSuffix) {
  EXPECT_EQ(unit_of_key("capsule_n_per_mm2"), "N/mm²");
  EXPECT_EQ(unit_of_key("capsule_n_per_mm"), "N/mm");
  EXPECT_EQ(unit_of_key("max_poses_per_s"), "1/s");
  EXPECT_EQ(unit_of_key("stale_pose_ms"), "ms");
  EXPECT_EQ(unit_of_key("relaxation_s"), "s");
  EXPECT_EQ(unit_of_key("count"), "");
}

}  // namespace
}  // namespace brachy
