#include "core/scene/choice/choice.h"

#include <gtest/gtest.h>

#include <set>

#include "core/base/error.h"
#include "core/base/number_csv.h"
#include "core/models/matrix_kernel/matrix_kernel_system.h"
#include "core/models/matrix_kernel/matrix_models.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"
#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"
#include "tests/sanitized.h"

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

// Largest error at the targets of a reference scene, of a stored row's settings solved exactly.
double error_at_targets(const ChartedRow& settings, const std::string& folder) {
  const std::filesystem::path at = std::filesystem::path(BRACHY_SOURCE_DIR "/tests/reference") / folder;
  const auto vectors = [&](const char* name, std::vector<Vec3>& p, std::vector<Vec3>& d) {
    const NumberTable table = load_number_csv(at / name, "x,y,z,dx,dy,dz");
    for (std::size_t i = 0; i < table.rows(); ++i) {
      p.emplace_back(table.row(i)[0], table.row(i)[1], table.row(i)[2]);
      d.emplace_back(table.row(i)[3], table.row(i)[4], table.row(i)[5]);
    }
  };
  std::vector<Vec3> p, d, X, u, kept_p, kept_d;
  vectors("landmarks.csv", p, d);
  vectors("targets.csv", X, u);
  const std::size_t every = p.size() > 1 && settings.landmark_spacing_mm > 1.5 * (p[1] - p[0]).norm() ? 2 : 1;
  for (std::size_t i = 0; i < p.size(); ++i)
    if (i % every == 0 || i + 1 == p.size()) {
      kept_p.push_back(p[i]);
      kept_d.push_back(d[i]);
    }
  std::vector<Vec3> found;
  if (is_matrix_model(settings.kernel)) {
    const auto kernel = make_matrix_kernel(settings.kernel, load_body(load_scene(at / "scene.toml")));
    MatrixKernelSystem system(*kernel);
    EXPECT_TRUE(system.factorize(kept_p));
    found = system.evaluate(X, system.solve(kept_d));
  } else {
    EXPECT_FALSE(settings.has_anchors);  // their positions are drawn by `brachy compare`
    const Kernel psi = *find_kernel(settings.kernel);
    RbfSystem system(psi, settings.support_mm, static_cast<int>(kept_p.size()));
    EXPECT_TRUE(system.factorize(kept_p));
    std::vector<Vec3> w(kept_p.size());
    system.solve(kept_d, w);
    const RbfField field{psi, settings.support_mm, kept_p, w};
    for (const Vec3& x : X) found.push_back(field.displacement(x));
  }
  double worst = 0;
  for (std::size_t i = 0; i < X.size(); ++i) worst = std::max(worst, (found[i] - u[i]).norm());
  return worst;
}

TEST(Choice, OnTheDefaultSceneEachToleranceTakesTheCheapestStoredRowAndItsErrorIsWhatTheReferenceSays) {
  if (test::kIsSanitized) GTEST_SKIP() << "a minute of arithmetic";
  const Scene scene = load_scene(BRACHY_SOURCE_DIR "/config/prostate.toml");
  const ElasticBody body = load_body(scene);
  const auto& rows = stored_comparison();
  const std::vector<std::string> scenes = nearest_scenes(body, rows);
  std::set<std::string> chosen;
  for (const double tolerance : {3.0, 1.0, 0.5, 0.2}) {
    const Choice choice = choose(body, {tolerance, scene.model.tick_budget_ms}, rows);
    EXPECT_TRUE(choice.meets_needs) << choice.reason;
    chosen.insert(choice.candidate.settings.model);
    for (const Candidate& other : candidates(scenes, rows, false))
      EXPECT_FALSE(other.settings.min_det > 0 && other.error_mm <= tolerance &&
                   other.tick_ms < choice.candidate.tick_ms)
          << other.settings.model << " is cheaper at " << tolerance;
    double worst = 0;
    for (const std::string& folder : scenes)
      worst = std::max(worst, error_at_targets(choice.candidate.settings, folder));
    EXPECT_LE(worst, tolerance);
    EXPECT_NEAR(worst, choice.candidate.error_mm, 0.02 + 0.02 * worst) << choice.candidate.settings.model;
  }
  EXPECT_GE(chosen.size(), 3u);
}

}  // namespace
}  // namespace brachy
