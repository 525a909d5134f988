// Files as scanners and planning systems write them, but rarely: read as they are meant, or refused by one line with
// the file, the tag and the fix.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <map>

#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/dose/source.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/geometry/volume/nrrd_file.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_plan.h"
#include "tests/apps/import/import_testing.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"

namespace brachy::test {
namespace {

void expect_volumes(const nlohmann::json& report, const nlohmann::json& expected_cc) {
  std::map<std::string, double> found;
  for (const auto& structure : report.at("structures"))
    found[structure.at("name")] = structure.at("surface_cc").get<double>();
  EXPECT_EQ(found.size(), expected_cc.size()) << report.at("structures").dump();
  for (const auto& [name, cc] : expected_cc.items())
    EXPECT_NEAR(found[name] / cc.get<double>(), 1, 0.01) << name;
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << word << " in: " << text;
}

/// Rows of seeds.csv; that `brachy dose` takes them, and implant.toml has them in the body.
void expect_seeds(const std::filesystem::path& scene, const nlohmann::json& expected) {
  const std::vector<DoseSeed> seeds = load_dose_seeds(scene / "seeds.csv");
  ASSERT_EQ(seeds.size(), expected.size());
  for (std::size_t n = 0; n < seeds.size(); ++n) {
    const std::vector<double> row = expected[n];
    EXPECT_LT((seeds[n].position - Vec3(row[0], row[1], row[2])).norm(), 1e-6);
    EXPECT_LT(seeds[n].axis.cross(Vec3(row[3], row[4], row[5])).norm(), 1e-6);
    EXPECT_EQ(tg43_source(seeds[n].source).number, row[6]);
    EXPECT_EQ(seeds[n].air_kerma_strength_u, row[7]);
  }
  EXPECT_EQ(to_csv(at_rest(load_seeds_at_start(load_scene(scene / "implant.toml")))), to_csv(seeds));
  const Ended dose = run_brachy({"dose", "--seeds", (scene / "seeds.csv").string(), "--config",
                                 (scene / "scene.toml").string(), "--json"});
  ASSERT_TRUE(exited(dose, 0)) << dose.err;
  const auto table = nlohmann::json::parse(dose.out);
  EXPECT_EQ(table.at("seeds"), expected.size());
  EXPECT_GT(table.at("structures").at(0).at("d90_gy"), 10);
}

struct ImportOddCases : ::testing::Test {
  static void SetUpTestSuite() {
    made_folder = new TempFolder;
    if (!has_pydicom()) return;
    const Ended made = run_python({source_file("make_odd_cases.py"), (*made_folder / "in").string()});
    ASSERT_TRUE(exited(made, 0)) << made.err;
  }
  static void TearDownTestSuite() {
    delete made_folder;
    made_folder = nullptr;
  }
  void SetUp() override {
    if (!has_pydicom()) GTEST_SKIP() << "python3-pydicom is not installed";
  }

  static TempFolder* made_folder;
  TempFolder out;
};
TempFolder* ImportOddCases::made_folder = nullptr;

TEST_F(ImportOddCases, AreReadAsTheyAreMeantOrRefusedInALine) {
  const nlohmann::json cases = json_file(*made_folder / "in/cases.json");
  EXPECT_GE(cases.size(), 50u);
  for (const auto& [name, expected] : cases.items()) {
    SCOPED_TRACE(name);
    const std::filesystem::path scene = out / "scene" / name;
    const Ended ended =
        run_brachy({"import", (*made_folder / "in" / name).string(), "--out", scene.string()});
    EXPECT_EQ(ended.signal, 0);
    if (expected.contains("refused")) {
      EXPECT_TRUE(refused_in_last_line(ended, expected.at("refused")));
      EXPECT_FALSE(std::filesystem::exists(scene));
      continue;
    }
    EXPECT_TRUE(exited(ended, 0)) << ended.err;
    if (ended.exit_code != 0) continue;
    expect_volumes(json_file(scene / "import.json"), expected.at("cc"));
    expect_words(ended.err, expected.value("says", nlohmann::json::array()));
    expect_words(ended.out, expected.value("out", nlohmann::json::array()));
    if (expected.contains("seeds")) expect_seeds(scene, expected.at("seeds"));
    for (const char* kind : {"volume", "dose"}) {
      if (!expected.contains(kind)) continue;
      const std::vector<double> place = expected.at(kind);
      const Volume volume = read_nrrd_file(scene / (std::string(kind) + ".nrrd")).volume;
      const Vec3 at(place[0], place[1], place[2]);
      const Vec3 index = volume.index_of(at);
      EXPECT_LT((index - index.array().round().matrix()).norm(), 1e-3) << index.transpose();
      EXPECT_NEAR(volume.at(at), place[3], 1e-2);
    }
  }
}

// From the series to a subscriber's screen, without an edit by hand.
TEST_F(ImportOddCases, AnUltrasoundSeriesIsWhatARunningDaemonsSubscriberSees) {
  const std::string scene = (out / "s/scene.toml").string();
  const Ended ended =
      run_brachy({"import", (*made_folder / "in/us_backwards").string(), "--out", (out / "s").string()});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  RunningBrachyd brachyd(scene);
  Peer viewer{net::Role::kViewer, net::kSubscribeUltrasound};
  ASSERT_TRUE(viewer.join(brachyd.port));
  ASSERT_TRUE(viewer.until([&] { return viewer.images.size() >= 30; }));
  const net::ImageMessage& image = viewer.images.back();
  ASSERT_FALSE(image.data.empty());
  const auto [least, most] = std::ranges::minmax(image.data);
  EXPECT_GT(most - least, 50) << "the series is a ramp of grey";
  brachyd.process.send_signal(SIGTERM);
  const Ended daemon = brachyd.process.wait();
  EXPECT_TRUE(exited(daemon, 0)) << daemon.err;
}

}  // namespace
}  // namespace brachy::test
