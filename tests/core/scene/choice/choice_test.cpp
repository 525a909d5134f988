#include "core/scene/choice/choice.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <set>

#include "core/base/error.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"
#include "test_paths.h"

namespace brachy {
namespace {

ChartedRow row(const std::string& model, const std::string& scene, double error_mm, double tick_ms,
               double contrast = 1, int free_faces = 0) {
  ChartedRow r;
  r.model = r.kernel = model;
  r.scene = scene;
  r.error_mm = error_mm;
  r.tick_ms = tick_ms;
  r.contrast = contrast;
  r.free_faces = free_faces;
  return r;
}

const std::vector<ChartedRow> kRows = {row("cheap", "a", 0.5, 0.1),  row("cheap", "b", 0.9, 0.1),
                                       row("good", "a", 0.1, 1.0),   row("good", "b", 0.2, 1.1),
                                       row("cheap", "c", 2, 0.1, 3), row("good", "c", 0.1, 1, 3),
                                       row("half", "a", 0.01, 0.01)};

TEST(Choice, TakesTheCheapestWhoseWorstNearestSceneMeetsTheTolerance) {
  const ElasticBody body;
  EXPECT_EQ(nearest_scenes(body, kRows), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(choose(body, {1, 2}, kRows).candidate.settings.model, "cheap");
  EXPECT_EQ(choose(body, {0.6, 2}, kRows).candidate.settings.model, "good");  // cheap has 0.9 on b
  EXPECT_TRUE(choose(body, {0.6, 2}, kRows).meets_needs);
}

TEST(Choice, SaysSoWhereNothingMeetsTheNeeds) {
  const Choice none = choose(ElasticBody{}, {0.6, 1}, kRows);
  EXPECT_FALSE(none.meets_needs);
  EXPECT_EQ(none.candidate.settings.model, "cheap");  // the best within the budget
  EXPECT_NE(none.reason.find("no model is charted for 0.6 mm within 1 ms"), std::string::npos) << none.reason;
}

TEST(Choice, FoldingModelsAreNotTaken) {
  std::vector<ChartedRow> rows = kRows;
  rows[1].min_det = -0.1;
  EXPECT_EQ(choose(ElasticBody{}, {1, 2}, rows).candidate.settings.model, "good");
}

TEST(Choice, ContrastAndFreeFacesDecideWhichScenesAreNear) {
  ElasticBody body;
  body.regions.push_back(
      std::make_shared<EllipsoidRegion>(Vec3(0, 0, 0), Vec3(10, 10, 10), 2.5 * body.shear_modulus));
  EXPECT_EQ(nearest_scenes(body, kRows), std::vector<std::string>{"c"});
}

TEST(Choice, RowsThatAreNotNumbersAreRefusedByLine) {
  try {
    parse_comparison("nonsense\n", "x.csv");
    FAIL();
  } catch (const UserError& e) {
    EXPECT_EQ(std::string(e.what()).find("x.csv:1: expected the header"), 0u);
  }
}

TEST(Choice, OtherKernelsAreLeftAlone) {
  Scene scene;
  EXPECT_EQ(with_choice(scene), scene);
}

// But for those with nodules, of which the choice knows nothing.
TEST(Choice, EveryModelIsChartedOnEveryLargeMotion) {
  const std::filesystem::path motions = BRACHY_SOURCE_DIR "/tests/reference/large_motion";
  std::set<std::pair<std::string, std::string>> charted;
  for (const ChartedRow& row : stored_comparison()) charted.insert({row.kernel, row.scene});
  for (const auto& folder : std::filesystem::directory_iterator(motions)) {
    if (!folder.is_directory() || load_scene(folder.path() / "scene.toml").regions.size() > 1) continue;
    for (const std::string& model : all_model_names())
      EXPECT_TRUE(charted.contains({model, folder.path().filename()})) << model << " " << folder.path();
  }
}

TEST(Choice, OnTheDefaultSceneTakesTheCheapestStoredRowThatMeetsTheTolerance) {
  const ElasticBody body = load_body(load_scene(BRACHY_SOURCE_DIR "/config/prostate.toml"));
  const auto& rows = stored_comparison();
  const std::vector<Candidate> all = candidates(nearest_scenes(body, rows), rows, false);
  double least_mm = std::numeric_limits<double>::max();
  for (const Candidate& c : all) least_mm = std::min(least_mm, c.error_mm);
  std::set<std::string> chosen;
  for (const double tolerance : {10.0, 1.05 * least_mm, 0.5 * least_mm}) {
    constexpr double kNoBudgetMs = 1000;
    const Choice choice = choose(body, {tolerance, kNoBudgetMs}, rows);
    EXPECT_EQ(choice.meets_needs, tolerance > least_mm) << choice.reason;
    chosen.insert(choice.candidate.settings.model);
    for (const Candidate& other : all)
      EXPECT_FALSE(other.settings.min_det > 0 && other.error_mm <= tolerance &&
                   other.tick_ms < choice.candidate.tick_ms)
          << other.settings.model << " is cheaper at " << tolerance;
  }
  EXPECT_GE(chosen.size(), 2u);
}

}  // namespace
}  // namespace brachy
