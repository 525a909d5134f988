#include "apps/score/exercise.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <set>

#include "core/base/error.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
#include "test_paths.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;

const fs::path kExercises = fs::path(BRACHY_SOURCE_DIR) / "config/exercises";

std::vector<fs::path> shipped() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kExercises))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  return files;
}

Score score_of(double mean_error_mm, std::uint32_t urethra_passes) {
  Score score;
  score.seeds.emplace();
  SeedScore seed;
  seed.planned.position = Vec3::Zero();
  seed.planned.axis = Vec3::UnitZ();
  score.seeds->by_position.placed = {seed, seed};
  score.seeds->by_position.rest.total_mm.mean = mean_error_mm;
  score.needles.motion.emplace();
  if (urethra_passes > 0) score.contacts = {{"urethra", "G7", urethra_passes, 2, 1}};
  return score;
}

Exercise bounded() {
  return {"small",
          "two seeds",
          {},
          {{"placed_at_least", 2}, {"mean_error_mm_at_most", 2}, {"organ_passes_at_most", 0}},
          false};
}

TEST(Exercises, FourteenAreShippedAndEachHasItsSceneAndItsPlan) {
  const std::vector<fs::path> files = shipped();
  EXPECT_EQ(files.size(), 14u);
  std::set<std::string> names;
  for (const fs::path& file : files) {
    const Exercise exercise = load_exercise(file);
    names.insert(exercise.name);
    const Scene scene = load_scene(exercise.scene);
    if (scene.implant.is_hdr()) {
      ASSERT_TRUE(load_hdr_plan(scene)) << file;
      EXPECT_EQ(load_hdr_plan(scene)->catheters.size(), scene.needle.count) << file;
      continue;
    }
    EXPECT_TRUE(load_plan(scene)) << file;
    EXPECT_EQ(scene.seeds.applicator, "train") << file;
  }
  EXPECT_EQ(names.size(), files.size());
}

TEST(Exercises, ASessionPassesWhereItKeepsAllBounds) {
  const ExerciseResult good = judge(bounded(), score_of(1.5, 0));
  EXPECT_TRUE(good.has_passed());
  EXPECT_EQ(good.bounds.size(), 3u);
}

TEST(Exercises, EachBoundThatIsBrokenIsNamed) {
  const ExerciseResult bad = judge(bounded(), score_of(2.5, 2));
  EXPECT_FALSE(bad.has_passed());
  const std::string text = to_text(bad);
  EXPECT_NE(text.find("not passed"), std::string::npos) << text;
  EXPECT_NE(text.find("MISS mean error 2.5 mm, at most 2"), std::string::npos) << text;
  EXPECT_NE(text.find("MISS passes through organs 2, at most 0"), std::string::npos) << text;
  EXPECT_NE(text.find("ok   seeds placed 2, at least 2"), std::string::npos) << text;
}

TEST(Exercises, AVolumeStudyIsJudgedByTheLastOne) {
  const Exercise exercise = load_exercise(kExercises / "11_volume_study.toml");
  Score score;
  EXPECT_FALSE(judge(exercise, score).has_passed()) << "none was made";
  ContourScore good;
  good.dice = 0.95;
  good.step_mm = 5;
  good.gland_cm3 = 30;
  good.outlined_cm3 = 28.5;
  good.hausdorff_95_mm = 2;
  ContourScore small = good;
  small.outlined_cm3 = 20;
  score.studies = {{10, small}, {20, good}};
  EXPECT_TRUE(judge(exercise, score).has_passed());
  score.studies.push_back({30, small});
  const std::string text = to_text(judge(exercise, score));
  EXPECT_NE(text.find("MISS volume study, error of the volume 33.33 %, at most 10"), std::string::npos)
      << text;
}

TEST(Exercises, WhatIsNotKnownPassesNothing) {
  const ExerciseResult result = judge(bounded(), Score{});
  EXPECT_FALSE(result.has_passed());
  for (const BoundResult& bound : result.bounds) EXPECT_NE(bound.text.find("not known"), std::string::npos);
}

TEST(Exercises, OnesThatLieWithASceneAreFoundAndItsOwnIsMarked) {
  std::vector<std::string> refusals;
  const std::vector<ExerciseFile> found = exercises_beside(kExercises / "scenes/05_apex.toml", refusals);
  EXPECT_EQ(refusals, std::vector<std::string>());
  ASSERT_EQ(found.size(), 14u);
  for (const ExerciseFile& file : found)
    EXPECT_EQ(file.is_of_scene, file.file.filename() == "05_apex.toml") << file.file;
  EXPECT_EQ(found[4].exercise.name, "the apex");

  const std::vector<ExerciseFile> others =
      exercises_beside(fs::path(BRACHY_CONFIG_DIR) / "prostate.toml", refusals);
  EXPECT_EQ(others.size(), 14u) << "offered to a daemon with another scene, too";
  for (const ExerciseFile& file : others) EXPECT_FALSE(file.is_of_scene);
}

TEST(Exercises, OneWithAMistakeIsLeftOutAndTheReasonSaid) {
  const test::TempFolder folder;
  folder.write("scene.toml", "");
  folder.write("notes.toml", "nothing = 1\n");
  folder.write("good.toml",
               "name = \"x\"\nasks = \"y\"\nscene = \"scene.toml\"\n[passes]\nplaced_at_least = 1\n");
  folder.write("bad.toml", "name = \"x\"\nasks = \"y\"\nscene = \"scene.toml\"\n[passes]\nplaced = 1\n");
  std::vector<std::string> refusals;
  const std::vector<ExerciseFile> found = exercises_beside(folder / "scene.toml", refusals);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(found[0].is_of_scene);
  ASSERT_EQ(refusals.size(), 1u);
  EXPECT_NE(refusals[0].find("bad.toml:5"), std::string::npos) << refusals[0];
}

// What somebody else put beside a scene is no exercise, and costs no memory and no time.
TEST(Exercises, TrapsBesideASceneAreLeftOut) {
  const test::TempFolder folder;
  const std::string good =
      "name = \"x\"\nasks = \"y\"\nscene = \"s/scene.toml\"\n[passes]\nplaced_at_least = 1\n";
  fs::create_directory(folder / "s");
  folder.write("s/scene.toml", "");
  folder.write("good.toml", good);
  folder.write("huge.toml", good);
  fs::resize_file(folder / "huge.toml", std::uintmax_t{3} << 30);  // sparse
  folder.write("64k.toml", good + std::string(kMostExerciseBytes, '#'));
  ASSERT_EQ(::mkfifo((folder / "fifo.toml").c_str(), 0600), 0);
  fs::create_symlink("good.toml", folder / "link.toml");
  fs::create_symlink("/dev/zero", folder / "zero.toml");
  fs::create_directory(folder / "folder.toml");
  std::size_t others = 0;
  if (::geteuid() == 0) {
    folder.write("theirs.toml", good);
    ASSERT_EQ(::chown((folder / "theirs.toml").c_str(), 65534, 65534), 0);
    others = 1;
  }
  std::vector<std::string> refusals;
  const std::vector<ExerciseFile> found = exercises_beside(folder / "s/scene.toml", refusals);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].file.filename(), "good.toml");
  EXPECT_EQ(found[0].exercise.text, good);
  EXPECT_EQ(refusals.size(), 4 + others);  // huge, 64k, fifo, folder
  if (others == 0) return;
  // The scene's owner may have put one there.
  ASSERT_EQ(::chown((folder / "s/scene.toml").c_str(), 65534, 65534), 0);
  EXPECT_EQ(exercises_beside(folder / "s/scene.toml", refusals).size(), 2u);
}

TEST(Exercises, OneThatIsNoFileIsRefusedAndNotWaitedFor) {
  const test::TempFolder folder;
  ASSERT_EQ(::mkfifo((folder / "fifo.toml").c_str(), 0600), 0);
  for (const fs::path& file :
       {folder / "fifo.toml", fs::path("/dev/zero"), folder / "", folder / "none.toml"})
    EXPECT_THROW(load_exercise(file), UserError) << file;
}

TEST(Exercises, WhatPassesIsALineForEachBound) {
  Exercise exercise = bounded();
  exercise.needs_implant_goals = true;
  EXPECT_EQ(
      what_passes(exercise),
      (std::vector<std::string>{"seeds placed at least 2", "mean error at most 2 mm",
                                "passes through organs at most 0", "every goal of the implant is met"}));
}

TEST(Exercises, AFileWithAMistakeIsRefusedWithItsLine) {
  const test::TempFolder folder;
  folder.write("scene.toml", "");
  const std::string head = "name = \"x\"\nasks = \"y\"\nscene = \"scene.toml\"\n";
  const auto refusal = [&](const std::string& text) -> std::string {
    folder.write("e.toml", text);
    try {
      load_exercise(folder / "e.toml");
    } catch (const UserError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(head + "[passes]\nplaced_at_least = 1\n"), "");
  EXPECT_NE(refusal(head + "[passes]\nplaced_atleast = 1\n").find("e.toml:5"), std::string::npos);
  EXPECT_NE(refusal(head + "[passes]\n").find("bounds nothing"), std::string::npos);
  EXPECT_NE(refusal("name = \"x\"\nasks = \"y\"\nscene = \"none.toml\"\n[passes]\nplaced_at_least = 1\n")
                .find("is not there"),
            std::string::npos);
  EXPECT_NE(refusal("name = \"x\"\n[passes]\nplaced_at_least = 1\n").find("asks"), std::string::npos);
}

}  // namespace
}  // namespace brachy
