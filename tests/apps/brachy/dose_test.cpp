// `brachy dose` end to end: exact sums, the grid that it writes, its DVH, and invalid input.
#include <array>
#include <cmath>
#include <cstring>
#include <set>

#include "core/base/number_csv.h"
#include "core/brachytherapy/dose/dose_rate.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;
using Json = nlohmann::json;

constexpr const char* kOutHeader = "x,y,z,dose_rate_cgy_h,total_gy";
const std::string kSeedLine = std::string(kDoseSeedHeader) + "\n";

struct Dose : ::testing::Test {
  TempFolder folder;
  std::string out = (folder / "O.csv").string();

  std::string seeds(const std::string& rows) { return folder.write("S.csv", kSeedLine + rows); }
  std::string points(const std::string& rows) { return folder.write("P.csv", "x,y,z\n" + rows); }
  Ended dose(std::vector<std::string> line) {
    line.insert(line.begin(), "dose");
    return run_brachy(line);
  }
  NumberTable doses_at(const std::string& seed_rows, const std::string& point_rows) {
    EXPECT_TRUE(exited(
        dose({"--seeds", seeds(seed_rows), "--points", points(point_rows), "--out", out, "--force"}), 0));
    return load_number_csv(out, kOutHeader);
  }
  // Twelve seeds through the small phantom.
  std::string some_seeds() {
    std::string rows;
    for (const int x : {-12, 0, 12})
      for (const int z : {-12, -4, 4, 12})
        rows += std::to_string(x) + ",3," + std::to_string(z) + ",0.1,0,1," +
                (x == 0 ? "200,2.5" : "6711,1.5") + "\n";
    return seeds(rows);
  }
};

// 1 U of the 6711 on the transverse axis at 1 cm: Λ, and 1984.7 cGy in all; Pd-103: 0.686 · 16.991 · 24/ln 2.
TEST_F(Dose, IsTheDoseRateConstantAtTheReferencePoint) {
  const NumberTable iodine = doses_at("0,0,0,0,0,1,6711,1\n", "10,0,0\n0,-10,0\n");
  for (const std::size_t i : {0, 1}) {
    EXPECT_NEAR(iodine.row(i)[3], 0.965, 1e-12);
    EXPECT_NEAR(iodine.row(i)[4], 19.847, 0.001 * 19.847);
  }
  const NumberTable palladium = doses_at("5,6,7,10,0,0,200,2\n", "5,16,7\n");
  EXPECT_NEAR(palladium.row(0)[3], 2 * 0.686, 1e-12);
  EXPECT_NEAR(palladium.row(0)[4], 2 * 0.686 * 16.991 * 24 / std::log(2.0) / 100, 1e-9);
}

TEST_F(Dose, IsTheSumOverTheSeedsAtEachPointInOrder) {
  const std::string first = "0,0,0,0,0,1,6711,0.4\n", second = "7,-3,2,1,1,0,200,1.9\n";
  const std::string at = "3,4,5\n0,0,0\n-20,1,1\n0,0,2.25\n100,100,100\n";
  const NumberTable a = doses_at(first, at), b = doses_at(second, at), both = doses_at(first + second, at);
  ASSERT_EQ(both.rows(), 5u);
  for (std::size_t i = 0; i < both.rows(); ++i) {
    for (const std::size_t k : {0, 1, 2}) EXPECT_EQ(both.row(i)[k], a.row(i)[k]);
    for (const std::size_t k : {3, 4}) {
      EXPECT_GT(a.row(i)[k], 0);
      EXPECT_NEAR(both.row(i)[k] / (a.row(i)[k] + b.row(i)[k]), 1, 1e-14);
    }
  }
  EXPECT_EQ(both.row(0)[1], 4);
  EXPECT_EQ(both.row(4)[2], 100);
}

TEST_F(Dose, SaysWhatItDidAsJson) {
  const Ended ended = dose({"--seeds", seeds("0,0,0,0,0,1,6711,0.4\n0,0,9,0,0,1,6711,0.5\n"), "--points",
                            points("10,0,0\n20,0,0\n"), "--out", out, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  const Json json = json_of(ended);
  const NumberTable table = load_number_csv(out, kOutHeader);
  EXPECT_EQ(json.at("seeds"), 2);
  EXPECT_DOUBLE_EQ(json.at("strength_u"), 0.9);
  EXPECT_EQ(json.at("points"), 2);
  EXPECT_EQ(json.at("least_gy"), table.row(1)[4]);
  EXPECT_EQ(json.at("largest_gy"), table.row(0)[4]);
  EXPECT_FALSE(json.contains("structures"));
}

TEST_F(Dose, RefusesBadFilesByLineAndWritesNothing) {
  const std::string good = "0,0,0,0,0,1,6711,1\n";
  const auto refused = [&](const std::string& seed_rows, const std::string& point_rows,
                           const std::vector<std::string>& parts) {
    EXPECT_TRUE(refused_in_one_line(
        dose({"--seeds", seeds(seed_rows), "--points", points(point_rows), "--out", out}), parts));
    EXPECT_FALSE(std::filesystem::exists(out));
  };
  refused(good + "0,0,0,0,0,0,6711,1\n", "1,1,1\n", {"S.csv:3:", "axis", "0,0,1"});
  refused("0,0,0,0,0,1,6702,1\n", "1,1,1\n", {"S.csv:2:", "6702", "6711", "200"});
  refused("0,0,0,0,0,1,6711,-2\n", "1,1,1\n", {"S.csv:2:", "strength_u"});
  refused("0,0,0,0,0,1,6711\n", "1,1,1\n", {"S.csv:2:"});
  refused("", "1,1,1\n", {"S.csv", "no rows"});
  refused(good, "1,1\n", {"P.csv:2:"});
  refused(good, "1,1,inf\n", {"P.csv:2:"});
  refused(good, "", {"P.csv", "no rows"});
  EXPECT_TRUE(refused_in_one_line(
      dose({"--seeds", (folder / "none.csv").string(), "--points", points("1,1,1\n"), "--out", out}),
      {"none.csv"}));
  EXPECT_TRUE(refused_in_one_line(
      dose({"--seeds", seeds(good), "--points", points("1,1,1\n"), "--out", (folder / "no/O.csv").string()}),
      {"O.csv", "no folder"}));
}

TEST_F(Dose, WantsAllItNeedsToBeSaid) {
  const std::string s = seeds("0,0,0,0,0,1,6711,1\n"), p = points("1,1,1\n");
  for (const std::vector<std::string>& line :
       std::vector<std::vector<std::string>>{{"--points", p, "--out", out},
                                             {"--seeds", s},
                                             {"--seeds", s, "--points", p},
                                             {"--seeds", s, "--out", out},
                                             {"--seeds", s, "--grid", out}}) {
    const Ended ended = dose(line);
    EXPECT_TRUE(exited(ended, 2));
    EXPECT_NE(ended.err.find("Try --help"), std::string::npos) << ended.err;
  }
  const Ended help = dose({"--help"});
  EXPECT_TRUE(exited(help, 0));
  EXPECT_NE(help.out.find("brachy dose --seeds S.csv --points P.csv --out O.csv"), std::string::npos);
}

// The value of a header's field.
std::string field_of(const std::string& nrrd, const std::string& name) {
  const std::size_t at = nrrd.find("\n" + name + ": ");
  if (at == std::string::npos) return "";
  const std::size_t from = at + name.size() + 3;
  return nrrd.substr(from, nrrd.find('\n', from) - from);
}

TEST_F(Dose, WritesAGridWhoseVoxelsAreTheExactSumsWhereItSaysTheyAre) {
  const std::string scene =
      folder.write("scene.toml", small_scene("[dose]\nspacing_mm = 3\nmargin_mm = 6\n"));
  const std::string grid = (folder / "dose.nrrd").string(), s = some_seeds();
  ASSERT_TRUE(exited(dose({"--seeds", s, "--config", scene, "--grid", grid}), 0));
  const std::string nrrd = read_file(grid);
  std::array<std::size_t, 3> size{};
  std::array<double, 3> origin{};
  ASSERT_EQ(std::sscanf(field_of(nrrd, "sizes").c_str(), "%zu %zu %zu", &size[0], &size[1], &size[2]), 3);
  ASSERT_EQ(std::sscanf(field_of(nrrd, "space origin").c_str(), "(%lf,%lf,%lf)", &origin[0], &origin[1],
                        &origin[2]),
            3);
  EXPECT_EQ(field_of(nrrd, "space directions"), "(3,0,0) (0,3,0) (0,0,3)");
  // The phantom is 50 × 40 × 45 mm about the origin.
  EXPECT_NEAR(origin[0], -31, 0.5);
  EXPECT_NEAR(origin[2], -28.5, 0.5);
  const std::size_t body = nrrd.find("\n\n") + 2;
  ASSERT_EQ(nrrd.size() - body, 4 * size[0] * size[1] * size[2]);
  const std::vector<DoseSeed> seeds = load_dose_seeds(s);
  for (std::size_t v = 0; v < size[0] * size[1] * size[2]; v += 97) {
    float gy;  // both ends little-endian here
    std::memcpy(&gy, nrrd.data() + body + 4 * v, 4);
    const Vec3 p = Vec3(origin[0], origin[1], origin[2]) +
                   3.0 * Vec3(static_cast<double>(v % size[0]), static_cast<double>(v / size[0] % size[1]),
                              static_cast<double>(v / size[0] / size[1]));
    EXPECT_NEAR(static_cast<double>(gy) / total_dose_gy(seeds, p), 1, 1e-3) << p.transpose();
  }
}

TEST_F(Dose, PrintsTheDvhOfTheScenesStructures) {
  const std::string scene =
      folder.write("scene.toml", small_scene("[dose]\nspacing_mm = 2\nprescription_gy = 100\n"));
  const std::string s = some_seeds();
  const Ended ended = dose({"--seeds", s, "--config", scene, "--json"});
  ASSERT_TRUE(exited(ended, 0));
  const Json json = json_of(ended);
  EXPECT_EQ(json.at("seeds"), 12);
  EXPECT_EQ(json.at("prescription_gy"), 100);
  ASSERT_GE(json.at("structures").size(), 3u);
  std::set<std::string> names;
  for (const Json& structure : json.at("structures")) {
    names.insert(structure.at("name"));
    EXPECT_GT(structure.at("volume_cc"), 0.0);
    EXPECT_GE(structure.at("v100_percent"), structure.at("v150_percent").get<double>());
    EXPECT_GE(structure.at("v150_percent"), structure.at("v200_percent").get<double>());
    EXPECT_LE(structure.at("min_gy"), structure.at("d90_gy").get<double>());
    EXPECT_LE(structure.at("d90_gy"), structure.at("d30_gy").get<double>());
    EXPECT_LE(structure.at("d30_gy"), structure.at("d10_gy").get<double>());
    EXPECT_LE(structure.at("d10_gy"), structure.at("max_gy").get<double>());
    EXPECT_NEAR(structure.at("v100_cc").get<double>(),
                structure.at("v100_percent").get<double>() / 100 * structure.at("volume_cc").get<double>(),
                1e-9);
  }
  EXPECT_TRUE(names.contains("prostate") && names.contains("urethra") && names.contains("rectum"));
  const Ended table = dose({"--seeds", s, "--config", scene});
  ASSERT_TRUE(exited(table, 0));
  for (const std::string& name : names) EXPECT_NE(table.out.find(name), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("100 Gy"), std::string::npos);
}

TEST_F(Dose, IsLessWhereTheGlandIsSwollenMeanwhile) {
  const std::string scene = folder.write("scene.toml", small_scene("[dose]\nspacing_mm = 2\n")),
                    s = some_seeds();
  const Json healed = json_of(dose({"--seeds", s, "--config", scene, "--json"}));
  const Json swollen = json_of(dose({"--seeds", s, "--config", scene, "--swelling", "--json"}));
  EXPECT_FALSE(healed.contains("swelling_resolved_days"));
  EXPECT_EQ(swollen.at("swelling_resolved_days"), 30);
  const double before = healed.at("structures").at(0).at("d90_gy"),
               after = swollen.at("structures").at(0).at("d90_gy");
  EXPECT_LT(after, 0.98 * before);
  EXPECT_GT(after, 0.85 * before);
  const Ended ended = dose({"--seeds", s, "--points", points("0,0,9\n"), "--out", out, "--swelling"});
  EXPECT_TRUE(exited(ended, 2));
  EXPECT_NE(ended.err.find("--swelling requires --config"), std::string::npos) << ended.err;
}

TEST_F(Dose, RefusesASceneOrAGridItCannotUse) {
  const std::string s = seeds("0,0,0,0,0,1,6711,1\n"), scene = folder.write("scene.toml", small_scene());
  EXPECT_TRUE(
      refused_in_one_line(dose({"--seeds", s, "--config", (folder / "none.toml").string()}), {"none.toml"}));
  EXPECT_TRUE(refused_in_one_line(
      dose({"--seeds", s, "--config", folder.write("bad.toml", small_scene("[dose]\nspacing_mm = 0.01\n"))}),
      {"bad.toml", "spacing_mm"}));
  EXPECT_TRUE(refused_in_one_line(
      dose({"--seeds", s, "--config", scene, "--grid", (folder / "no/dose.nrrd").string()}), {"no folder"}));
}

}  // namespace
}  // namespace brachy
