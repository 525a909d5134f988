#include "apps/import/case/staged_folder.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy::test {
namespace {

TEST(StagedFolder, LeavesNothingWithoutPublish) {
  const TempFolder out;
  {
    const StagedFolder staged(out / "scene");
    out.write("scene/.writing/scene.toml", "half");
    EXPECT_TRUE(std::filesystem::exists(staged.stage() / "scene.toml"));
    EXPECT_FALSE(std::filesystem::exists(out / "scene/scene.toml"));
  }
  EXPECT_FALSE(std::filesystem::exists(out / "scene"));
}

TEST(StagedFolder, LeavesWhatWasInTheFolder) {
  const TempFolder out;
  std::filesystem::create_directories(out / "scene");
  out.write("scene/scene.toml", "earlier");
  {
    const StagedFolder staged(out / "scene");
    out.write("scene/.writing/scene.toml", "half");
  }
  EXPECT_EQ(read_file(out / "scene/scene.toml"), "earlier");
  EXPECT_FALSE(std::filesystem::exists(out / "scene/.writing"));
}

TEST(StagedFolder, PublishesOverEarlierFilesAndWhatAKilledProcessLeft) {
  const TempFolder out;
  std::filesystem::create_directories(out / "scene/.writing");
  out.write("scene/scene.toml", "earlier");
  out.write("scene/.writing/left.ply", "of a killed process");
  {
    StagedFolder staged(out / "scene");
    out.write("scene/.writing/scene.toml", "new");
    staged.publish();
  }
  EXPECT_EQ(read_file(out / "scene/scene.toml"), "new");
  EXPECT_FALSE(std::filesystem::exists(out / "scene/left.ply"));
  EXPECT_FALSE(std::filesystem::exists(out / "scene/.writing"));
}

TEST(StagedFolder, SaysWhereItCannotWrite) {
  const TempFolder out;
  const std::string file = out.write("file", "");
  EXPECT_THROW(StagedFolder(std::filesystem::path(file) / "scene"), UserError);
}

}  // namespace
}  // namespace brachy::test
