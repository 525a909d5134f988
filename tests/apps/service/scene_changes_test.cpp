#include "apps/daemon/service/scene_changes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "core/scene/file/scene_file.h"
#include "core/scene/file/scene_keys.h"
#include "test_paths.h"

namespace brachy {
namespace {

TEST(SceneChanges, OfTheSameSceneThereAreNone) {
  const SceneChanges none = changes_of(Scene{}, parse_scene("# a comment moves lines", "scene.toml"));
  EXPECT_TRUE(none.taken.empty() && none.kept.empty());
  EXPECT_EQ(none.scene, Scene{});
}

TEST(SceneChanges, TakesWhatASimulatorIsMadeOfAndKeepsTheRest) {
  const Scene read = parse_scene(
      "[tissue]\npoints = 5000\ncutting_force_n = 2\n[model]\nkernel = \"psi30\"\n[contact]\n"
      "tip_core_mm = 9\n[server]\nport = 1\n[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\n"
      "radius_mm = 5\nshear_modulus_kpa = 9\n",
      "scene.toml");
  const SceneChanges changes = changes_of(Scene{}, read);
  EXPECT_EQ(changes.taken, (std::vector<std::string>{"tissue.cutting_force_n", "region", "model.kernel",
                                                     "contact.tip_core_mm"}));
  EXPECT_EQ(changes.kept, (std::vector<std::string>{"tissue.points", "server.port"}));
  EXPECT_EQ(changes.scene.model, read.model);
  EXPECT_EQ(changes.scene.regions, read.regions);
  EXPECT_EQ(changes.scene.tissue.points, Scene{}.tissue.points);
  EXPECT_EQ(changes.scene.server, Scene{}.server);
}

TEST(SceneChanges, WhereSomethingStandsInTheFileIsNoChange) {
  const std::string region =
      "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 5\n"
      "shear_modulus_kpa = 9\n[[structure]]\nname = \"duct\"\nfile = \"duct.stl\"\n";
  const SceneChanges none =
      changes_of(parse_scene(region, "scene.toml"), parse_scene("# lower\n" + region, "scene.toml"));
  EXPECT_TRUE(none.taken.empty() && none.kept.empty());
}

/// Every "key = value" of a scene file that has all of them, as "table.key".
std::set<std::string> keys_of_file(const std::string& file) {
  std::set<std::string> keys;
  std::ifstream in(file);
  std::string table;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('['))
      table = line.substr(1, line.find(']') - 1) + ".";
    else if (const auto equals = line.find(" = ");
             equals != std::string::npos && !line.starts_with('#') && !line.starts_with(' '))
      keys.insert(table + line.substr(0, equals));
  }
  return keys;
}

TEST(SceneChanges, CompareEveryKeyOfTheDefaultSceneButThoseOfAuto) {
  std::set<std::string> keys = keys_of_file(BRACHY_CONFIG_DIR "/prostate.toml");
  ASSERT_GT(keys.size(), 80u);
  for (const SceneSection& section : scene_sections())
    for (const Key<Scene>& key : section.keys)
      if (key.reload != Reload::kIgnored)
        keys.erase((section.is_top() ? "" : std::string(section.name) + ".") + key.name);
  // What auto chooses shows in other keys.
  const std::set<std::string> left = {"model.tolerance_mm", "model.tick_budget_ms", "model.needs"};
  EXPECT_EQ(keys, left);
}

}  // namespace
}  // namespace brachy
