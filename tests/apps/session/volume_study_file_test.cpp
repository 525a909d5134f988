#include "apps/session/volume_study_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

RecordedStudy made_up() {
  RecordedStudy recorded;
  recorded.t_s = 12.5;
  recorded.study = {RigidTransform(), 5, 1.25, {}};
  recorded.study.X_WS.p = {1, 2, 3};
  const std::vector<PlaneEdge> outline = {
      {Vec2(0, 0), Vec2(10, 0)}, {Vec2(10, 0), Vec2(0, 10.125)}, {Vec2(0, 10.125), Vec2(0, 0)}};
  recorded.study.planes = {{3, 0, 0, outline, outline}, {std::nullopt, 0, 5, {}, outline}};
  recorded.sources = {{42, -5}, {43, NAN}};
  return recorded;
}

std::string all_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(VolumeStudyFile, ScoresAfterReadingAsItDidBefore) {
  const RecordedStudy before = made_up();
  const std::vector<RecordedStudy> read = parse_studies(study_line(before) + study_line(before), "s");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(study_line(read[1]), study_line(before));
  const ContourScore was = score_study(before.study), is = score_study(read[0].study);
  EXPECT_EQ(is.dice, was.dice);
  EXPECT_EQ(is.missed, 1u);
  EXPECT_EQ(is.gland_cm3, 1.25);
  EXPECT_TRUE(std::isnan(read[0].sources[1].probe_depth_mm));
}

TEST(VolumeStudyFile, IsAppendedToAndHealsFromALineThatWasCutOff) {
  const test::TempFolder folder;
  append_study(SessionFolder::make(folder / ""), made_up());
  const std::string one = all_of(folder / kStudiesFile);
  EXPECT_EQ(one, study_line(made_up()));
  std::ofstream(folder / kStudiesFile, std::ios::app) << one.substr(0, one.size() / 2);
  append_study(SessionFolder::make(folder / ""), made_up());
  EXPECT_EQ(all_of(folder / kStudiesFile), one + one);
}

TEST(VolumeStudyFile, IsRefusedByNameAndLine) {
  try {
    parse_studies(study_line(made_up()) + "{\"t_s\": 1}\n", "volume_studies.jsonl");
    FAIL() << "accepted";
  } catch (const UserError& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with("volume_studies.jsonl:2: is no volume study")) << e.what();
  }
}

}  // namespace
}  // namespace brachy
