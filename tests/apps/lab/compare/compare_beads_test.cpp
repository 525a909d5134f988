#include <gtest/gtest.h>

#include <fstream>
#include <set>

#include "core/base/number_csv.h"
#include "core/base/rigid_transform.h"
#include "core/kernels/kernels.h"
#include "tests/apps/apps_testing.h"
#include "tests/data_dir.h"
#include "tests/sanitized.h"

namespace brachy {
namespace {

using namespace test;

// Every model of bead_model.h, which are the ψ kernels and two more, and the affine map.
const std::set<std::string> kModels = [] {
  std::set<std::string> names = {"affine", "compact_elastic", "elastic"};
  for_each_kernel([&](auto kernel) { names.emplace(kernel.kName); });
  return names;
}();

// A lattice of 4 × 4 × 4 beads 10 mm apart, load N being N times the displacement gradient below.
std::string affine_beads(int loads) {
  std::string text = "i,j,k,x0,y0,z0";
  for (int n = 1; n <= loads; ++n)
    for (const char axis : {'x', 'y', 'z'}) text += std::string(",") + axis + std::to_string(n);
  Mat3 gradient;
  gradient << 0.02, 0.01, 0, -0.01, 0.03, 0.005, 0, 0.01, -0.06;
  for (int i = 0; i < 64; ++i) {
    const Vec3 lattice(i / 16, i / 4 % 4, i % 4), rest = 10 * lattice + Vec3(3, -7, 11);
    std::vector<double> row(lattice.begin(), lattice.end());
    row.insert(row.end(), rest.begin(), rest.end());
    for (int n = 1; n <= loads; ++n) {
      const Vec3 moved = rest + n * (gradient * rest + Vec3(1, 2, -0.5));
      row.insert(row.end(), moved.begin(), moved.end());
    }
    text += '\n';
    append_csv_row(text, row);
  }
  return text + '\n';
}

// The rows of `brachy compare --beads FILE --json …`; empty unless it exits with 0.
nlohmann::json rows_of(const std::string& file) {
  const TempFolder folder;
  const std::string json = (folder / "rows.json").string();
  const Ended ended = run_process(brachy_line({"compare", "--beads", file, "--json", json}));
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.out.find("elastic"), std::string::npos);
  if (ended.exit_code != 0) return nlohmann::json::array();
  return nlohmann::json::parse(read_file(json)).at("rows");
}

TEST(CompareBeads, RecoversAnAffineMotionUnderEveryLoad) {
  const TempFolder folder;
  const nlohmann::json rows = rows_of(folder.write("beads.csv", affine_beads(3)));
  ASSERT_EQ(rows.size(), 3 * kModels.size());
  for (const auto& row : rows) {
    EXPECT_TRUE(kModels.contains(row.at("model")));
    EXPECT_LT(row.at("rms_mm").get<double>(), 1e-6) << row;
    EXPECT_LE(row.at("rms_mm").get<double>(), row.at("max_mm").get<double>()) << row;
  }
}

TEST(CompareBeads, ColumnsAreFoundByName) {
  const TempFolder folder;
  std::string text = affine_beads(1);
  text.replace(0, text.find('\n'), "i,j,k,x0,y0,z0,x7,y7,z7");
  const nlohmann::json rows = rows_of(folder.write("beads.csv", text));
  ASSERT_EQ(rows.size(), kModels.size());
  EXPECT_EQ(rows[0].at("load"), 7);
}

TEST(CompareBeads, RefusesWhatItCannotUseInOneLine) {
  const TempFolder folder;
  const auto refused = [&](const std::string& text, const std::vector<std::string>& parts) {
    return refused_in_one_line(run_brachy({"compare", "--beads", folder.write("beads.csv", text)}), parts);
  };
  const std::string good = affine_beads(1);
  const std::string rows = good.substr(good.find('\n'));
  EXPECT_TRUE(refused("i,j,k,x0,y0,z0,x1,y1,zz" + rows, {"no column 'z1'"}));
  EXPECT_TRUE(refused("i,j,k,x0,y0,z0,a,b,c" + rows, {"no columns of a load"}));
  EXPECT_TRUE(refused("i,j,k,x0,y0,x0,x1,y1,z1" + rows, {"'x0' appears twice"}));
  EXPECT_TRUE(refused("i,j,k,\x1B[2J,\x1B[2J,x0,x1,y1,z1" + rows, {" [2j' has other characters"}));
  EXPECT_TRUE(refused(good + "1,1,1.5,0,0,0,0,0,0\n", {"beads.csv:66", "whole numbers"}));
  EXPECT_TRUE(refused(good + "0,0,0,3,-7,11,0,0,0\n", {"beads.csv:66", "line 2"}));
  EXPECT_TRUE(refused(good + "0,0,0,3,-7,,0,0,0\n", {"beads.csv:66", "column 6"}));
  EXPECT_TRUE(refused(good.substr(0, good.find("\n1,")), {"interior"}));
  EXPECT_TRUE(refused("", {"empty"}));
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"compare", "--beads", "nowhere.csv"}), {"nowhere.csv: no such file"}));
}

TEST(CompareBeads, EveryModelPredictsTheTruthCubesSecondLoad) {
  if (test::kIsSanitized) GTEST_SKIP() << "minutes of arithmetic";
  BRACHY_REQUIRE_DATA(data);
  const nlohmann::json rows = rows_of((data / "truthcube" / "beads.csv").string());
  ASSERT_EQ(rows.size(), 2 * kModels.size());
  for (const auto& row : rows) {
    if (row.at("model") == "affine") continue;  // 0.39 and 0.59 mm
    // ψ3,0 has a cusp at every landmark and is only just below the limit.
    EXPECT_LE(row.at("rms_mm").get<double>(), 0.42 + (row.at("model") == "psi30" ? 0.005 : 0)) << row;
    if (row.at("model") == "elastic") {
      EXPECT_LE(row.at("rms_mm").get<double>(), 0.38) << row;
    }
  }
}

}  // namespace
}  // namespace brachy
