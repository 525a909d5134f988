#include "apps/score/recording.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/score/score_fixtures.h"

namespace brachy {
namespace {

using namespace test;

std::string seeds_csv() {
  std::string text = std::string(kSeedHeader) + "\n";
  for (const Seed& seed : small_seeds()) text += seed_row(seed) + "\n";
  return text;
}

std::string poses_csv() {
  return std::string(kTrajectoryHeader) + ",button\n" + trajectory_row(straight(0, 1, 2, 3)) + ",0\n" +
         trajectory_row(straight(1, 1, 2, 4)) + ",1\n";
}

std::string forces_csv() {
  return std::string(kForceLogHeader) + "\n" +
         force_row(force_at(0, 0, ContactState::kTouching, Vec3(0, 0, -1))) + "\n";
}

struct RecordingFolder : ::testing::Test {
  TempFolder folder;
  void write_all() {
    folder.write("poses.csv", poses_csv());
    folder.write("forces.csv", forces_csv());
    folder.write("seeds.csv", seeds_csv());
  }
  Recording load() { return load_recording(folder / ""); }
};

TEST_F(RecordingFolder, IsReadWhole) {
  write_all();
  const Recording recording = load();
  ASSERT_TRUE(recording.poses);
  EXPECT_TRUE(recording.poses->button(0, 1));
  EXPECT_EQ(recording.forces.size(), 1u);
  ASSERT_TRUE(recording.seeds);
  EXPECT_EQ(recording.seeds->size(), 3u);
  EXPECT_TRUE(recording.remarks.empty());
  EXPECT_TRUE(recording.name.starts_with("brachy_test_")) << recording.name;
}

TEST_F(RecordingFolder, OfALateMachineHasTheTimesOfTheClock) {
  write_all();
  folder.write("clock.csv", "t_s,wall_s\n0,0\n0.5,0.5\n1,2\n");
  const Recording recording = load();
  ASSERT_TRUE(recording.poses);
  EXPECT_DOUBLE_EQ(recording.poses->duration_s(), 2);
  EXPECT_DOUBLE_EQ(recording.clock.wall_s(0.75), 1.25)
      << "for what is not in the recording: changes of the plan";
  ASSERT_EQ(recording.remarks.size(), 1u);
  EXPECT_NE(recording.remarks[0].find("50 % of the simulation's ticks were missed"), std::string::npos)
      << recording.remarks[0];
  for (std::size_t n = 0; n < small_seeds().size(); ++n) {
    const double t_s = small_seeds()[n].t_s;
    EXPECT_DOUBLE_EQ(recording.seeds->at(n).t_s, t_s <= 0.5 ? t_s : t_s <= 1 ? 3 * t_s - 1 : t_s + 1);
  }
}

TEST_F(RecordingFolder, WithoutAFileSaysWhichAndReadsTheRest) {
  write_all();
  std::filesystem::remove(folder / "forces.csv");
  const Recording recording = load();
  EXPECT_TRUE(recording.poses && recording.seeds && recording.forces.empty());
  ASSERT_EQ(recording.remarks.size(), 1u);
  EXPECT_TRUE(recording.remarks[0].starts_with("forces.csv is missing")) << recording.remarks[0];
}

TEST_F(RecordingFolder, CutOffWithinALineIsReadUpToIt) {
  write_all();
  const std::string whole = seeds_csv();
  folder.write("seeds.csv", whole.substr(0, whole.size() - 30));
  const Recording recording = load();
  ASSERT_TRUE(recording.seeds);
  EXPECT_EQ(recording.seeds->size(), 2u);
  ASSERT_EQ(recording.remarks.size(), 1u);
  EXPECT_TRUE(recording.remarks[0].starts_with("seeds.csv ends within a line")) << recording.remarks[0];
}

TEST_F(RecordingFolder, CutOffWithinItsHeaderIsLeftOut) {
  write_all();
  folder.write("poses.csv", "t_s,m00,m0");
  const Recording recording = load();
  EXPECT_FALSE(recording.poses);
  ASSERT_EQ(recording.remarks.size(), 1u);
  EXPECT_TRUE(recording.remarks[0].starts_with("poses.csv:1: ")) << recording.remarks[0];
}

TEST_F(RecordingFolder, WithABrokenRowSaysItsLineAndReadsTheRest) {
  write_all();
  folder.write("forces.csv", forces_csv() + "1,0,nowhere,0,0,0,0,0,0,0,0,0,1,0,0,0,0\n");
  const Recording recording = load();
  EXPECT_TRUE(recording.poses && recording.seeds && recording.forces.empty());
  ASSERT_EQ(recording.remarks.size(), 1u);
  EXPECT_TRUE(recording.remarks[0].starts_with("forces.csv:3: state")) << recording.remarks[0];
}

TEST_F(RecordingFolder, CutOffAnywhereIsReadInPartOrLeftOutButNeverWrong) {
  write_all();
  const std::string whole = seeds_csv();
  const std::vector<Seed> all = small_seeds();
  for (std::size_t length = 0; length < whole.size(); length += 7) {
    folder.write("seeds.csv", whole.substr(0, length));
    const Recording recording = load();
    EXPECT_EQ(recording.remarks.size() == 1u, length == 0 || whole[length - 1] != '\n' || !recording.seeds)
        << length;
    if (!recording.seeds) continue;
    ASSERT_LE(recording.seeds->size(), all.size());
    for (std::size_t i = 0; i < recording.seeds->size(); ++i)
      EXPECT_EQ((*recording.seeds)[i], all[i]) << length;
  }
}

TEST_F(RecordingFolder, WithNothingToReadIsRefused) {
  const auto refusal = [&](const std::filesystem::path& path) -> std::string {
    try {
      load_recording(path);
    } catch (const UserError& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_NE(refusal(folder / "none").find("no such directory"), std::string::npos);
  EXPECT_NE(refusal(folder / "").find("poses.csv is missing"), std::string::npos);
}

}  // namespace
}  // namespace brachy
