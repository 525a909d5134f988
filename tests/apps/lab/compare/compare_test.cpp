// `brachy compare` end to end: its rows against errors computed here; times are not tested.
#include <cmath>
#include <map>

#include "core/solve/rbf_field.h"
#include "core/solve/rbf_system.h"
#include "tests/apps/lab/reference_run.h"

namespace brachy {
namespace {

using namespace test;
using Json = nlohmann::json;
namespace fs = std::filesystem;

struct Compare : ::testing::Test {
  TempFolder folder;

  static std::vector<std::string> line(std::vector<std::string> more,
                                       const fs::path& references = kReferences) {
    more.insert(more.begin(), {"compare", "--quick", "--references", references.string()});
    return more;
  }
  static Ended compare(std::vector<std::string> more, const fs::path& references = kReferences) {
    return run_brachy(line(std::move(more), references));
  }
  static Json rows_of(std::vector<std::string> more) { return run_on_references(line(std::move(more))).rows; }
};

TEST_F(Compare, RowsOfPsiAreTheErrorsOfThePlainInterpolant) {
  const Json rows =
      rows_of({"--models", "psi31_a12,buhmann_a24", "--scenes", "straight_stiff,push_homogeneous"});
  std::size_t checked = 0;
  for (const Json& row : rows) {
    if (row.at("anchors").get<bool>()) continue;
    const fs::path scene = kReferences / row.at("scene").get<std::string>();
    const double support = row.at("support_mm");
    const Kernel kernel = *find_kernel(row.at("kernel").get<std::string>());
    const ReferenceVectors landmarks = load_vectors(scene / "landmarks.csv"),
                           field = load_vectors(scene / "field.csv"),
                           targets = load_vectors(scene / "targets.csv");
    RbfSystem system(kernel, support, static_cast<int>(landmarks.positions.size()));
    ASSERT_TRUE(system.factorize(landmarks.positions));
    std::vector<Vec3> weights(landmarks.positions.size());
    system.solve(landmarks.displacements, weights);
    const RbfField exact{kernel, support, landmarks.positions, weights};

    double wrong = 0, all = 0, most = 0, at_targets = 0, det = 1e9;
    for (std::size_t i = 0; i < field.positions.size(); ++i) {
      const double error = (exact.displacement(field.positions[i]) - field.displacements[i]).norm();
      wrong += error * error;
      all += field.displacements[i].squaredNorm();
      most = std::max(most, error);
      det = std::min(det, exact.jacobian(field.positions[i]));
    }
    for (std::size_t i = 0; i < targets.positions.size(); ++i) {
      at_targets += (exact.displacement(targets.positions[i]) - targets.displacements[i]).norm() / 20;
      det = std::min(det, exact.jacobian(targets.positions[i]));
    }
    EXPECT_EQ(targets.positions.size(), 20u);
    EXPECT_NEAR(row.at("rel_l2"), std::sqrt(wrong / all), 1e-5);
    EXPECT_NEAR(row.at("max_mm"), most, 1e-4);
    EXPECT_NEAR(row.at("target_mm"), at_targets, 1e-4);
    EXPECT_NEAR(row.at("min_det"), det, 1e-5);
    EXPECT_GT(row.at("tick_ms"), 0.0);
    EXPECT_GT(row.at("setup_ms"), 0.0);
    EXPECT_GE(row.at("bytes"), 0);
    ++checked;
  }
  EXPECT_EQ(checked, 8u);  // each with a volume's points and with a surface's
}

TEST_F(Compare, RunsTheComparatorsBesideThem) {
  const Json rows =
      rows_of({"--models", "thin_plate,multiquadric,mass_spring_8mm,chainmail,paper,psi31_a12_anchors",
               "--scenes", "lateral_homogeneous"});
  std::map<std::string, Json> by_model;
  for (const Json& row : rows) by_model[row.at("model")] = row;
  EXPECT_EQ(by_model.size(), 8u);
  for (const auto& [model, row] : by_model) {
    EXPECT_FALSE(row.contains("error")) << model;
    EXPECT_EQ(row.at("group"), "homogeneous");
    EXPECT_GT(row.at("rel_l2"), 0.01) << model << " is not that good";
  }
  // The same landmarks and anchors: the same field, by two programs.
  EXPECT_NEAR(by_model.at("paper_csrbf_psi31_a12").at("rel_l2"),
              by_model.at("psi31_a12_anchors").at("rel_l2"), 1e-5);
  // For a spline without other landmarks, a straight shaft moved sideways is a translation.
  EXPECT_NEAR(by_model.at("thin_plate").at("min_det"), 1, 1e-6);
  EXPECT_GT(by_model.at("mass_spring_8mm").at("ticks_to_rest"), 3);
  EXPECT_EQ(by_model.at("chainmail_4mm").at("ticks_to_rest"), 1);
}

TEST_F(Compare, KeepsTheNonlinearSceneOutOfMeans) {
  for (const Json& row : rows_of({"--models", "psi30_a24", "--scenes", "neo_hookean,straight_h"}))
    EXPECT_EQ(row.at("counts"), row.at("scene") != "neo_hookean");
  const Ended ended = compare({"--models", "psi30_a24", "--scenes", "neo_hookean"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("| psi30_a24 | – | – | – | 5"), std::string::npos) << ended.out;
}

TEST_F(Compare, NamesWhatIsWrongWithTheReferences) {
  EXPECT_TRUE(refused_in_one_line(compare({}, folder / "nowhere"), {"nowhere", "--references"}));
  EXPECT_TRUE(refused_in_one_line(compare({}, folder / ""), {"scene.toml", "--references"}));

  fs::create_directories(folder / "references/lateral");
  const fs::path from = kReferences / "lateral_stiff", to = folder / "references/lateral";
  for (const char* file : {"scene.toml", "landmarks.csv", "field.csv"}) fs::copy_file(from / file, to / file);
  EXPECT_TRUE(refused_in_one_line(compare({}, folder / "references"), {"lateral/targets.csv"}));
  folder.write("references/lateral/targets.csv", "x,y,z\n1,2,3\n");
  EXPECT_TRUE(refused_in_one_line(compare({}, folder / "references"), {"lateral/targets.csv:1"}));
}

TEST_F(Compare, NamesModelsAndScenesThatDoNotExist) {
  EXPECT_TRUE(
      refused_in_one_line(compare({"--models", "psi31_a12,abacus"}), {"--models", "abacus", "thin_plate"}));
  EXPECT_TRUE(refused_in_one_line(compare({"--scenes", "moon"}), {"--scenes", "moon", "lateral_stiff"}));
  EXPECT_TRUE(refused_in_one_line(compare({"--models", "psi31_a12", "--scenes", "push_stiff", "--json",
                                           (folder / "no/where.json").string()}),
                                  {"where.json"}));
}

}  // namespace
}  // namespace brachy
