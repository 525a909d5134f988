#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "tests/apps/apps_testing.h"
#include "tests/apps/dense_field.h"
#include "tests/core/kernels/kernel_formulas.h"

namespace brachy {
namespace {

using namespace test;
using Row = std::vector<double>;

std::string csv_number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

std::string to_csv(const std::string& header, const std::vector<Row>& rows) {
  std::string text = header + "\n";
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i) text += ',';
      text += csv_number(row[i]);
    }
    text += "\n";
  }
  return text;
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

DenseField::Vec vec(const Row& row, std::size_t first) {
  return {row[first], row[first + 1], row[first + 2]};
}

DenseField dense(const std::string& kernel, double support, const std::vector<Row>& landmarks) {
  std::vector<DenseField::Landmark> list;
  for (const Row& row : landmarks) list.push_back({vec(row, 0), vec(row, 3)});
  return {kernel, support, list};
}

// On a jittered grid, a third of the support apart; every fourth is an anchor.
std::vector<Row> well_separated(int count, double support, std::mt19937& random) {
  std::uniform_real_distribution<double> jitter(-0.03 * support, 0.03 * support),
      displace(-0.08 * support, 0.08 * support);
  std::vector<Row> landmarks;
  for (int i = 0; i < count; ++i) {
    Row row = {support / 3 * (i % 4) + jitter(random), support / 3 * (i / 4 % 4) + jitter(random),
               support / 3 * (i / 16) + jitter(random)};
    for (int k = 0; k < 3; ++k) row.push_back(i % 4 == 3 ? 0 : displace(random));
    landmarks.push_back(row);
  }
  return landmarks;
}

std::vector<Row> points_around(const std::vector<Row>& landmarks, double support, std::mt19937& random) {
  std::uniform_real_distribution<double> coordinate(-support, 2 * support);
  std::vector<Row> points;
  for (int i = 0; i < 60; ++i) points.push_back({coordinate(random), coordinate(random), coordinate(random)});
  for (const Row& row : landmarks) points.push_back({row[0], row[1], row[2]});
  points.push_back({1000, -1000, 1000});
  return points;
}

constexpr const char* kLandmarkHeader = "x,y,z,dx,dy,dz";

struct Deform : ::testing::Test {
  TempFolder folder;
  std::string out = (folder / "O.csv").string();

  std::string landmarks(const std::vector<Row>& rows) {
    return folder.write("L.csv", to_csv(kLandmarkHeader, rows));
  }
  std::string points(const std::vector<Row>& rows) { return folder.write("P.csv", to_csv("x,y,z", rows)); }

  // With sensible defaults for omitted options.
  Ended deform(const std::string& landmark_file, const std::string& point_file,
               const std::vector<std::string>& more = {}, const std::string& support = "12") {
    std::vector<std::string> line = {"deform",   "--force",   "--landmarks", landmark_file, "--points",
                                     point_file, "--support", support,       "--out",       out};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  }
};

const std::vector<Row> kOneLandmark = {{0, 0, 0, 1, 0, 0}};
const std::vector<Row> kTwoPoints = {{0, 0, 0}, {1, 2, 3}};

class DeformAgainstDense : public Deform, public ::testing::WithParamInterface<std::tuple<Kernel, double>> {};

TEST_P(DeformAgainstDense, EqualsAnIndependentLongDoubleEvaluation) {
  const double support = std::get<1>(GetParam());
  const std::string kernel(name_of(std::get<0>(GetParam())));
  std::mt19937 random(42);
  for (const int count : {1, 7, 40}) {
    SCOPED_TRACE(std::to_string(count) + " landmarks");
    const std::vector<Row> given = well_separated(count, support, random);
    const std::vector<Row> at = points_around(given, support, random);
    const Ended ended =
        deform(landmarks(given), points(at), {"--kernel", kernel, "--jacobian"}, csv_number(support));
    ASSERT_TRUE(exited(ended, 0));
    const DenseField field = dense(kernel, support, given);
    const auto lines = lines_of(read_file(out));
    ASSERT_EQ(lines.size(), at.size() + 1);
    EXPECT_EQ(lines[0], "x,y,z,dx,dy,dz,det");
    for (std::size_t i = 0; i < at.size(); ++i) {
      const auto cells = cells_of(lines[i + 1]);
      ASSERT_EQ(cells.size(), 7u);
      for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(std::stod(cells[k]), at[i][k]);
      const auto u = field.displacement(vec(at[i], 0));
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(std::stod(cells[3 + k]), static_cast<double>(u[k]), 1e-12) << lines[i + 1];
      EXPECT_NEAR(std::stod(cells[6]), static_cast<double>(field.determinant(vec(at[i], 0))), 1e-12)
          << lines[i + 1];
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AllKernels, DeformAgainstDense,
                         ::testing::Combine(::testing::ValuesIn(all_kernels()),
                                            ::testing::Values(6.0, 12.0, 40.0)),
                         [](const auto& test) {
                           return std::string(name_of(std::get<0>(test.param))) + "_support" +
                                  csv_number(std::get<1>(test.param));
                         });

TEST_F(Deform, ReproducesLandmarksAndLeavesWhatIsOutOfReachExactlyThere) {
  std::mt19937 random(3);
  const auto given = well_separated(20, 12, random);
  const auto at = points_around(given, 12, random);
  ASSERT_TRUE(exited(deform(landmarks(given), points(at)), 0));
  const auto lines = lines_of(read_file(out));
  ASSERT_EQ(lines.size(), at.size() + 1);
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto cells = cells_of(lines[1 + 60 + i]);
    for (std::size_t k = 3; k < 6; ++k) EXPECT_NEAR(std::stod(cells[k]), given[i][k], 1e-9);
  }
  EXPECT_EQ(lines.back(), "1000,-1000,1000,0,0,0");
}

TEST_F(Deform, WritesSeventeenSignificantDigits) {
  std::mt19937 random(4);
  const auto given = well_separated(9, 12, random);
  ASSERT_TRUE(exited(deform(landmarks(given), points(points_around(given, 12, random))), 0));
  const auto lines = lines_of(read_file(out));
  ASSERT_GT(lines.size(), 2u);
  std::size_t longest = 0;
  for (std::size_t i = 1; i < lines.size(); ++i)
    for (const std::string& cell : cells_of(lines[i])) {
      EXPECT_EQ(cell, csv_number(std::stod(cell)));
      longest = std::max(longest, cell.size());
    }
  EXPECT_GE(longest, 19u);  // 17 digits, sign and point
}

TEST_F(Deform, SaysInJsonWhatItDid) {
  const Ended ended = deform(landmarks({{0, 0, 0, 1, 0, 0}, {5, 0, 0, 0, 0, 0}}),
                             points({{0, 0, 0}, {1, 1, 1}, {100, 0, 0}}), {"--json"});
  ASSERT_TRUE(exited(ended, 0));
  const auto json = json_of(ended);
  ASSERT_FALSE(json.is_discarded()) << ended.out;
  EXPECT_EQ(json.at("landmarks"), 2);
  EXPECT_EQ(json.at("points"), 3);
  EXPECT_EQ(json.at("moved"), 2);
  EXPECT_EQ(json.at("folded"), 0);
  EXPECT_NEAR(json.at("max_disp_mm").get<double>(), 1, 1e-12);
  EXPECT_GT(json.at("min_det").get<double>(), 0);
  EXPECT_LT(json.at("min_det").get<double>(), 1);
}

TEST_F(Deform, DeformsAMeshIntoAPly) {
  const std::string mesh = folder.write("in.stl", octahedron_stl(10));
  const std::vector<Row> given = {{10, 0, 0, 0.5, 1, -0.25}, {0, 10, 0, 0, 0, 0}};
  const std::string ply = (folder / "out.ply").string();
  const Ended ended = run_brachy({"deform", "--force", "--landmarks", landmarks(given), "--mesh", mesh,
                                  "--support", "15", "--out", ply, "--jacobian", "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended).at("points"), 6);

  const auto lines = lines_of(read_file(ply));
  const auto body = std::find(lines.begin(), lines.end(), "end_header");
  ASSERT_NE(body, lines.end());
  EXPECT_NE(std::find(lines.begin(), body, "element vertex 6"), body);
  EXPECT_NE(std::find(lines.begin(), body, "element face 8"), body);
  EXPECT_NE(std::find(lines.begin(), body, "property double det"), body);
  ASSERT_EQ(lines.end() - body, 1 + 6 + 8);
  std::vector<Row> written;
  for (auto line = body + 1; line != body + 7; ++line) {
    Row row;
    std::istringstream in(*line);
    for (double v; in >> v;) row.push_back(v);
    ASSERT_EQ(row.size(), 4u);
    written.push_back(row);
  }
  const DenseField field = dense("psi31", 15, given);
  for (int axis = 0; axis < 3; ++axis)
    for (const double end : {-10.0, 10.0}) {
      DenseField::Vec x{};
      x[axis] = end;
      const auto u = field.displacement(x);
      const auto same = [&](const Row& row) {
        for (int k = 0; k < 3; ++k)
          if (!(std::abs(row[k] - static_cast<double>(x[k] + u[k])) <= 1e-12)) return false;
        return std::abs(row[3] - static_cast<double>(field.determinant(x))) <= 1e-12;
      };
      EXPECT_EQ(std::count_if(written.begin(), written.end(), same), 1) << "axis " << axis << ", " << end;
    }

  const auto inspected = json_of(run_brachy({"inspect", ply, "--json"}));
  ASSERT_FALSE(inspected.is_discarded());
  EXPECT_EQ(inspected.at("surface_vertices"), 6);
  EXPECT_EQ(inspected.at("bad_edges"), 0);
  EXPECT_EQ(inspected.at("flipped_triangles"), 0);
}

TEST_F(Deform, RefusesFilesItCannotUseInOneLineWithTheirPlace) {
  const std::string good_l = landmarks(kOneLandmark), good_p = points(kTwoPoints);
  const auto bad = [&](const std::string& text) { return folder.write("bad.csv", text); };
  const std::string header = std::string(kLandmarkHeader) + "\n";
  EXPECT_TRUE(refused_in_one_line(deform((folder / "none.csv").string(), good_p), {"none.csv"}));
  EXPECT_TRUE(refused_in_one_line(deform(bad("x,y,z\n0,0,0\n"), good_p), {"bad.csv:1", kLandmarkHeader}));
  EXPECT_TRUE(refused_in_one_line(deform(bad(header + "0,0,0,nan,0,0\n"), good_p), {"bad.csv:2", "nan"}));
  EXPECT_TRUE(refused_in_one_line(deform(bad(header + "0,0,0,inf,0,0\n"), good_p), {"bad.csv:2", "inf"}));
  EXPECT_TRUE(refused_in_one_line(deform(bad(header + "0,0,0,0,0\n"), good_p), {"bad.csv:2", "5 columns"}));
  EXPECT_TRUE(refused_in_one_line(deform(bad(header + "0,0,0,x,0,0\n"), good_p), {"bad.csv:2"}));
  EXPECT_TRUE(refused_in_one_line(deform(bad(header), good_p), {"bad.csv:1", "no rows"}));
  EXPECT_TRUE(refused_in_one_line(deform(bad(""), good_p), {"bad.csv:1", "empty"}));
  EXPECT_TRUE(refused_in_one_line(deform(good_l, (folder / "none.csv").string()), {"none.csv"}));
  EXPECT_TRUE(refused_in_one_line(deform(good_l, bad("x,y,z\n0,0,0\n1,2,nan\n")), {"bad.csv:3", "nan"}));
  EXPECT_TRUE(refused_in_one_line(deform(good_l, bad("x,y,z\n0,0\n")), {"bad.csv:2", "2 columns"}));
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(Deform, RefusesWrongUsageWithTwo) {
  const std::string l = landmarks(kOneLandmark), p = points(kTwoPoints);
  const auto usage = [&](std::vector<std::string> line, const std::string& hint) {
    line.insert(line.begin(), {"deform", "--force", "--landmarks", l, "--out", out});
    const Ended ended = run_brachy(line);
    EXPECT_TRUE(exited(ended, 2));
    EXPECT_EQ(ended.out, "");
    EXPECT_NE(ended.err.find(hint), std::string::npos) << ended.err;
  };
  usage({"--points", p, "--support", "12", "--kernel", "psi99"}, "psi99");
  usage({"--points", p, "--support", "-12"}, "--support");
  usage({"--points", p, "--support", "0"}, "--support");
  usage({"--points", p, "--support", "nan"}, "--support");
  usage({"--points", p}, "--support");
  usage({"--support", "12"}, "--points");
  usage({"--points", p, "--mesh", p, "--support", "12"}, "--mesh");
  usage({"--points", p, "--support", "12", "--colour", "red"}, "--colour");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(Deform, RefusesAnOutputItCannotWrite) {
  const std::string l = landmarks(kOneLandmark), p = points(kTwoPoints);
  out = (folder / "no/such/folder.csv").string();
  EXPECT_TRUE(refused_in_one_line(deform(l, p), {"folder.csv", "cannot be written"}));
  out = folder.write("file", "");
  std::filesystem::remove(out);
  std::filesystem::create_directory(out);
  EXPECT_TRUE(refused_in_one_line(deform(l, p), {"is a folder"}));
  EXPECT_TRUE(std::filesystem::is_directory(out));
  if (std::filesystem::exists("/dev/full")) {
    out = "/dev/full";
    EXPECT_TRUE(refused_in_one_line(deform(l, p), {"/dev/full", "cannot be written"}));
    EXPECT_TRUE(std::filesystem::exists("/dev/full"));
  }
}

TEST_F(Deform, RefusesAMeshItCannotRead) {
  const std::string l = landmarks(kOneLandmark);
  const auto with_mesh = [&](const std::string& mesh) {
    return run_brachy({"deform", "--force", "--landmarks", l, "--mesh", mesh, "--support", "12", "--out",
                       (folder / "o.ply").string()});
  };
  EXPECT_TRUE(refused_in_one_line(with_mesh((folder / "none.stl").string()), {"none.stl"}));
  EXPECT_TRUE(refused_in_one_line(with_mesh(folder.write("empty.stl", "")), {"empty.stl"}));
  EXPECT_TRUE(refused_in_one_line(with_mesh(folder.write("text.xyz", "0 0 0\n")), {"text.xyz"}));
  EXPECT_FALSE(std::filesystem::exists(folder / "o.ply"));
}

TEST_F(Deform, RefusesContradictoryLandmarksWithThreeAndNamesBothLines) {
  const std::string l = landmarks({{0, 0, 0, 1, 0, 0}, {5, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 1, 0}});
  const Ended ended = deform(l, points(kTwoPoints));
  ASSERT_TRUE(exited(ended, 3));
  ASSERT_EQ(lines_of(ended.err).size(), 1u) << ended.err;
  EXPECT_NE(ended.err.find("L.csv:4"), std::string::npos) << ended.err;
  EXPECT_NE(ended.err.find("line 2"), std::string::npos) << ended.err;
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(Deform, RefusesSingularLandmarksWithThree) {
  std::vector<Row> crowd;
  for (int i = 0; i < 64; ++i)
    crowd.push_back({1e-3 * (i % 4), 1e-3 * (i / 4 % 4), 1e-3 * (i / 16), i % 2 ? 0.1 : -0.1, 0, 0});
  const Ended ended = deform(landmarks(crowd), points(kTwoPoints), {"--kernel", "psi32"}, "40");
  ASSERT_TRUE(exited(ended, 3));
  ASSERT_EQ(lines_of(ended.err).size(), 1u) << ended.err;
  EXPECT_NE(ended.err.find("singular"), std::string::npos) << ended.err;
  EXPECT_NE(ended.err.find("--support"), std::string::npos) << "no fix named: " << ended.err;
  EXPECT_FALSE(std::filesystem::exists(out));
}

// The supports and the spacing in the message can be solved.
TEST_F(Deform, ARefusalNamesSupportsThatWouldDo) {
  std::vector<Row> row;
  for (int i = 0; i < 12; ++i) row.push_back({0, 0, 0.02 * i, 0.01, 0, 0});
  const Ended ended = deform(landmarks(row), points(kTwoPoints), {"--kernel", "psi32"}, "40");
  ASSERT_TRUE(exited(ended, 3));
  const auto after = [&](const std::string& words) {
    const std::size_t at = ended.err.find(words);
    return at == std::string::npos ? 0 : std::stod(ended.err.substr(at + words.size()));
  };
  const double support = after("supports up to "), spacing = after("thinned to ");
  EXPECT_GT(support, 0.02) << ended.err;
  EXPECT_GT(spacing, 0.02) << ended.err;
  EXPECT_TRUE(
      exited(deform(landmarks(row), points(kTwoPoints), {"--kernel", "psi32"}, csv_number(support)), 0));
  EXPECT_TRUE(exited(
      deform(landmarks(row), points(kTwoPoints), {"--kernel", "psi32"}, csv_number(1.05 * support)), 3));
  std::vector<Row> thin;
  for (const Row& landmark : row)
    if (thin.empty() || landmark[2] - thin.back()[2] >= spacing) thin.push_back(landmark);
  EXPECT_GT(thin.size(), 1u);
  EXPECT_TRUE(exited(deform(landmarks(thin), points(kTwoPoints), {"--kernel", "psi32"}, "40"), 0));
}

// The paper's rule, K_ij = ψ(|p_i − p_j| / a_j): exactly singular here (core/DESIGN.md, section 2), regular
// some percent beside it.
TEST_F(Deform, ASupportOfTheLandmarksOwnIsThePapersRule) {
  const auto triple = [&](double h, double share) {
    const double a = 4 * h, b = share * 11.660167858376596 * h;
    return folder.write("T.csv",
                        to_csv("x,y,z,dx,dy,dz,support",
                               {{0, 0, 0, 1, 0, 0, a}, {0, 0, h, 0, 1, 0, b}, {0, 0, 2 * h, 0, 0, 1, a}}));
  };
  const auto run = [&](const std::string& file, const std::vector<Row>& at) {
    return run_brachy(
        {"deform", "--force", "--landmarks", file, "--points", points(at), "--out", out, "--json"});
  };
  for (const double h : {0.1, 1.0, 3.0}) {
    const Ended singular = run(triple(h, 1), kTwoPoints);
    ASSERT_TRUE(exited(singular, 3));
    ASSERT_EQ(lines_of(singular.err).size(), 1u) << singular.err;
    EXPECT_NE(singular.err.find("condition number"), std::string::npos) << singular.err;
    EXPECT_NE(singular.err.find("1e+12"), std::string::npos) << singular.err;
    EXPECT_FALSE(std::filesystem::exists(out));

    const Ended solved = run(triple(h, 1.04), {{0, 0, 0}, {0, 0, h}, {0, 0, 2 * h}, {0, 0, -4 * h}});
    ASSERT_TRUE(exited(solved, 0));
    EXPECT_GT(json_of(solved).at("condition").get<double>(), 30);
    const auto lines = lines_of(read_file(out));
    ASSERT_EQ(lines.size(), 5u);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(std::stod(cells_of(lines[1 + i])[3 + k]), i == k, 1e-12) << lines[1 + i];
    std::filesystem::remove(out);
  }
}

TEST_F(Deform, SupportsOfTheirOwnThatAreAllTheSameAreTheCommonOne) {
  std::mt19937 random(6);
  const std::vector<Row> given = well_separated(12, 12, random);
  const std::string p = points(points_around(given, 12, random));
  ASSERT_TRUE(exited(deform(landmarks(given), p), 0));
  const auto common = lines_of(read_file(out));
  std::vector<Row> own = given;
  for (Row& row : own) row.push_back(12);
  own[3].back() = 0;  // takes --support
  ASSERT_TRUE(exited(deform(folder.write("S.csv", to_csv("x,y,z,dx,dy,dz,support", own)), p), 0));
  const auto lines = lines_of(read_file(out));
  ASSERT_EQ(lines.size(), common.size());
  for (std::size_t i = 1; i < lines.size(); ++i)
    for (std::size_t k = 3; k < 6; ++k)
      EXPECT_NEAR(std::stod(cells_of(lines[i])[k]), std::stod(cells_of(common[i])[k]), 1e-12);
}

TEST_F(Deform, RefusesSupportsItCannotUse) {
  const auto own = [&](const std::string& text) { return folder.write("S.csv", text); };
  const std::string p = points(kTwoPoints);
  const auto run = [&](const std::string& file, const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {"deform", "--force", "--landmarks", file, "--points", p, "--out", out};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  const std::string header = "x,y,z,dx,dy,dz,support\n";
  EXPECT_TRUE(refused_in_one_line(run(own(header + "0,0,0,1,0,0,-2\n")), {"S.csv:2", "not positive"}));
  EXPECT_TRUE(refused_in_one_line(run(own(header + "0,0,0,1,0,0,0\n")), {"S.csv:2", "--support"}));
  EXPECT_TRUE(
      refused_in_one_line(run(own(header + "0,0,0,1,0,0,5\n"), {"--kernel", "elastic", "--core-radius", "2"}),
                          {"S.csv", "--kernel psi31"}));
  EXPECT_TRUE(refused_in_one_line(run(own("x,y,z,dx,dy,dz,support,support\n0,0,0,1,0,0,5,5\n")),
                                  {"S.csv:1", "unknown columns 'support'"}));
  EXPECT_TRUE(refused_in_one_line(run(own("x,y,z,dx,dy,dz,colour\n0,0,0,1,0,0,5\n")),
                                  {"S.csv:1", "unknown columns 'colour'"}));
  for (const char* both : {"support,core_mm", "core_mm,support"})
    EXPECT_TRUE(exited(run(own("x,y,z,dx,dy,dz," + std::string(both) + "\n0,0,0,1,0,0,5,5\n")), 0));
  const Ended twice = run(own(header + "0,0,0,1,0,0,5\n0,0,0,1,0,0,6\n"));
  ASSERT_TRUE(exited(twice, 3));
  EXPECT_NE(twice.err.find("S.csv:3: contradicts line 2"), std::string::npos) << twice.err;
}

TEST_F(Deform, MergesLandmarksThatSayTheSame) {
  std::mt19937 random(5);
  std::vector<Row> given = well_separated(8, 12, random);
  const std::string p = points(points_around(given, 12, random));
  const Ended plain = deform(landmarks(given), p, {"--jacobian"});
  ASSERT_TRUE(exited(plain, 0));
  EXPECT_EQ(plain.err, "");
  const std::string expected = read_file(out);
  given.insert(given.begin() + 5, given[2]);
  given.push_back(given[0]);
  const Ended merged = deform(landmarks(given), p, {"--jacobian", "--json"});
  ASSERT_TRUE(exited(merged, 0));
  EXPECT_EQ(read_file(out), expected);
  EXPECT_EQ(json_of(merged).at("landmarks"), 8);
  ASSERT_EQ(lines_of(merged.err).size(), 2u) << merged.err;
  EXPECT_NE(merged.err.find("L.csv:7: merged with line 4"), std::string::npos) << merged.err;
  EXPECT_NE(merged.err.find("L.csv:11: merged with line 2"), std::string::npos) << merged.err;
}

TEST_F(Deform, ReportsFoldingAndRefusesItOnlyWhenStrict) {
  // psi31 at a = 6 folds beyond 2.84 mm, first at a quarter of the support ahead of the push.
  const std::string p = points({{0, 0, 0}, {1.5, 0, 0}, {-1.5, 0, 0}});
  const std::string folding = landmarks({{0, 0, 0, 3.0, 0, 0}});
  const Ended reported = deform(folding, p, {"--json"}, "6");
  ASSERT_TRUE(exited(reported, 0));
  EXPECT_NE(reported.err.find("folds"), std::string::npos) << reported.err;
  EXPECT_NE(reported.err.find("1 of 3"), std::string::npos) << reported.err;
  EXPECT_EQ(json_of(reported).at("folded"), 1);
  EXPECT_LT(json_of(reported).at("min_det").get<double>(), 0);
  EXPECT_TRUE(std::filesystem::exists(out));

  std::filesystem::remove(out);
  const Ended strict = deform(folding, p, {"--strict"}, "6");
  EXPECT_TRUE(exited(strict, 3));
  EXPECT_EQ(lines_of(strict.err).size(), 1u) << strict.err;
  EXPECT_FALSE(std::filesystem::exists(out));

  const Ended injective = deform(landmarks({{0, 0, 0, 2.7, 0, 0}}), p, {"--strict"}, "6");
  EXPECT_TRUE(exited(injective, 0));
  EXPECT_EQ(injective.err, "");
}

const std::string kScene =
    "[box]\nsize_mm = [96, 96, 96]\nheld = [\"-x\", \"+x\", \"-y\", \"+y\", \"-z\", \"+z\"]\n"
    "[needle]\nradius_mm = 2\n[model]\nkernel = \"elastic\"\n";
// As long as a real shaft: the middle of a short one is affected by its ends.
const std::vector<Row> kShaft = [] {
  std::vector<Row> rows;
  for (int k = 0; k <= 12; ++k) rows.push_back({0, 0, 16 - 3.0 * k, 0, 0, 3});
  return rows;
}();

struct DeformByScene : Deform {
  Ended by_scene(const std::string& landmark_file, const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {"deform",      "--force",
                                     "--landmarks", landmark_file,
                                     "--points",    points({{0, 0, 0}, {0, 5, 0}, {0, 47.9, 0}}),
                                     "--scene",     folder.write("S.toml", kScene),
                                     "--out",       out,
                                     "--json"};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  }
  double displacement(std::size_t point) {  // along z
    return std::stod(cells_of(lines_of(read_file(out)).at(point + 1)).at(5));
  }
};

TEST_F(DeformByScene, AShaftMovesWhatIsInsideItRigidlyAndHeldWallsStay) {
  const Ended ended = by_scene(landmarks(kShaft));
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_NEAR(displacement(0), 3, 0.15);
  EXPECT_GT(displacement(1), 0.5);
  EXPECT_LT(displacement(1), 2.9);
  EXPECT_LT(std::abs(displacement(2)), 0.05);
  const nlohmann::json json = nlohmann::json::parse(ended.out);
  EXPECT_EQ(json.at("kernel"), "elastic");
  EXPECT_GT(json.at("force_n").at(2), 0.1);
}

TEST_F(DeformByScene, ForcesFollowTheModulusAndDisplacementsDoNot) {
  const Ended soft = by_scene(landmarks(kShaft), {"--shear-modulus-kpa", "2"});
  ASSERT_TRUE(exited(soft, 0));
  const double u = displacement(1);
  const Ended stiff = by_scene(landmarks(kShaft), {"--shear-modulus-kpa", "6"});
  ASSERT_TRUE(exited(stiff, 0));
  EXPECT_NEAR(displacement(1), u, 1e-9);
  EXPECT_NEAR(nlohmann::json::parse(stiff.out)["force_n"][2].get<double>() /
                  nlohmann::json::parse(soft.out)["force_n"][2].get<double>(),
              3, 1e-9);
}

TEST_F(DeformByScene, ACoreOfItsOwnMakesALandmarkAPoint) {
  const std::string cored = folder.write("C.csv", "x,y,z,dx,dy,dz,core_mm\n0,0,4,0,0,3,5\n0,0,-8,0,0,3,0\n");
  ASSERT_TRUE(exited(by_scene(cored), 0));
  const double wide = displacement(1);
  ASSERT_TRUE(
      exited(by_scene(folder.write("D.csv", "x,y,z,dx,dy,dz,core_mm\n0,0,4,0,0,3,2\n0,0,-8,0,0,3,0\n")), 0));
  EXPECT_GT(wide, displacement(1));
  EXPECT_TRUE(refused_in_one_line(by_scene(folder.write("E.csv", "x,y,z,dx,dy,dz,core_mm\n0,0,4,0,0,3,-2\n")),
                                  {"core_mm is negative"}));
}

TEST_F(DeformByScene, RefusesACrowdAndNamesASpacingThatWouldDo) {
  std::vector<Row> crowd;
  for (int i = 0; i < 8; ++i) crowd.push_back({0, 0, 1e-3 * i, 0, 0, 1});
  const std::string cored = "x,y,z,dx,dy,dz,core_mm";
  for (Row& row : crowd) row.push_back(2.5);
  const Ended ended = by_scene(folder.write("C.csv", to_csv(cored, crowd)));
  ASSERT_TRUE(exited(ended, 3));
  ASSERT_EQ(lines_of(ended.err).size(), 1u) << ended.err;
  const std::size_t at = ended.err.find("thinned to ");
  ASSERT_NE(at, std::string::npos) << ended.err;
  const double spacing = std::stod(ended.err.substr(at + 11));
  std::vector<Row> thin;
  for (const Row& row : crowd)
    if (thin.empty() || row[2] - thin.back()[2] >= spacing) thin.push_back(row);
  EXPECT_TRUE(exited(by_scene(folder.write("C.csv", to_csv(cored, thin))), 0));
}

TEST_F(DeformByScene, NearDuplicatesOnANeedleAreOnePlace) {
  std::vector<Row> twice = kShaft;
  twice.insert(twice.begin() + 4, twice[3]);
  twice[4][2] += 1e-6;  // under a millionth of the needle's 2 mm
  const Ended merged = by_scene(landmarks(twice));
  ASSERT_TRUE(exited(merged, 0));
  EXPECT_NE(merged.err.find("merged with line 5"), std::string::npos) << merged.err;
  EXPECT_EQ(json_of(merged).at("landmarks"), kShaft.size());
  twice[4][5] = 2;
  const Ended contradictory = by_scene(landmarks(twice));
  ASSERT_TRUE(exited(contradictory, 3));
  EXPECT_NE(contradictory.err.find("contradicts line 5"), std::string::npos) << contradictory.err;
}

TEST_F(DeformByScene, EveryModelCanBeAskedFor) {
  for (const char* model_name : {"compact_elastic", "elastic", "fem"}) {
    ASSERT_TRUE(exited(by_scene(landmarks(kShaft), {"--kernel", model_name}), 0)) << model_name;
    EXPECT_GT(displacement(1), 0.3) << model_name;
  }
}

// Away from the blend, inside and outside are separate fields with their own supports, equal to an independent
// long-double evaluation of the landmarks there alone.
TEST_F(Deform, RegionsOfASceneHaveSupportsOfTheirOwn) {
  const std::string scene = folder.write(
      "S.toml",
      "[model]\nkernel = \"psi32\"\nsupport_radius_mm = 12\n"
      "[[region]]\nshape = \"sphere\"\ncentre_mm = [0, 0, 0]\nradius_mm = 10\nsupport_radius_mm = 18\n"
      "blend_mm = 4\n");
  const std::vector<Row> inside = {{0, 0, 0, 1, 0.5, 0}, {4, 0, -3, 0, -1, 0.3}},
                         outside = {{20, 0, 0, 0, 0, 1}, {16, 3, 5, 0.4, 0, 0}};
  std::vector<Row> given = inside;
  given.insert(given.end(), outside.begin(), outside.end());
  const std::vector<Row> at = {{1, 2, 3}, {-5, 5, 0}, {18, 2, 1}, {12.5, 0, 0}, {-30, 0, 0}};
  const auto by_scene = [&](const std::vector<Row>& rows, const std::vector<std::string>& more) {
    std::vector<std::string> line = {"deform",   "--force",  "--landmarks", landmarks(rows),
                                     "--points", points(at), "--scene",     scene,
                                     "--out",    out,        "--jacobian"};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  ASSERT_TRUE(exited(by_scene(given, {}), 0));
  const DenseField within = dense("psi32", 18, inside), around = dense("psi32", 12, outside);
  const auto lines = lines_of(read_file(out));
  ASSERT_EQ(lines.size(), at.size() + 1);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const auto cells = cells_of(lines[i + 1]);
    const DenseField& field = i < 2 ? within : around;
    const auto u = field.displacement(vec(at[i], 0));
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(std::stod(cells[3 + k]), static_cast<double>(u[k]), 1e-12) << lines[i + 1];
    EXPECT_NEAR(std::stod(cells[6]), static_cast<double>(field.determinant(vec(at[i], 0))), 1e-12);
  }

  given.push_back({0, 10, 0, 0, 0.5, 0.5});  // amid the blend
  for (const char* model_name : {"psi30", "buhmann"}) {
    const Ended ended = by_scene(given, {"--kernel", model_name, "--json"});
    ASSERT_TRUE(exited(ended, 0)) << model_name;
    EXPECT_FALSE(json_of(ended).contains("force_n")) << model_name;
  }
  const Ended compact = by_scene(given, {"--kernel", "compact_elastic", "--json"});
  ASSERT_TRUE(exited(compact, 0));
  EXPECT_TRUE(json_of(compact).contains("force_n"));
  EXPECT_TRUE(refused_in_one_line(by_scene(given, {"--kernel", "fem"}),
                                  {"S.toml:4", "'region.shear_modulus_kpa' is missing", "fem"}));
}

TEST_F(Deform, LandmarksAmidABlendAreReproduced) {
  const std::string scene =
      folder.write("S.toml",
                   "[[region]]\nshape = \"ellipsoid\"\ncentre_mm = [0, 0, 0]\nsemi_axes_mm = [12, 9, 10]\n"
                   "support_radius_mm = 40\nblend_mm = 8\n");
  std::vector<Row> given, at;
  for (int k = 0; k < 12; ++k) {
    given.push_back({2.5 * k - 14, 1, 0.3 * k, 0.3, -0.2 * k, 1});
    at.push_back({2.5 * k - 14, 1, 0.3 * k});
  }
  for (const char* model_name : {"psi31", "compact_elastic"}) {
    ASSERT_TRUE(exited(run_brachy({"deform", "--force", "--landmarks", landmarks(given), "--points",
                                   points(at), "--scene", scene, "--kernel", model_name, "--out", out}),
                       0))
        << model_name;
    const auto lines = lines_of(read_file(out));
    ASSERT_EQ(lines.size(), at.size() + 1);
    for (std::size_t i = 0; i < at.size(); ++i)
      for (std::size_t k = 3; k < 6; ++k)
        EXPECT_NEAR(std::stod(cells_of(lines[i + 1])[k]), given[i][k], 1e-9) << model_name;
  }
}

TEST_F(Deform, WithoutASceneElasticNeedsACore) {
  const std::string at = points(kTwoPoints), from = landmarks(kOneLandmark);
  const auto run = [&](const std::vector<std::string>& more) {
    std::vector<std::string> line = {"deform", "--force", "--landmarks", from, "--points", at, "--out", out};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  EXPECT_TRUE(refused_in_one_line(run({"--kernel", "elastic"}), {"give --core-radius"}));
  EXPECT_TRUE(refused_in_one_line(run({"--kernel", "compact_elastic"}), {"--core-radius"}));
  EXPECT_TRUE(refused_in_one_line(run({"--kernel", "fem"}), {"--scene"}));
  EXPECT_TRUE(refused_in_one_line(run({"--kernel", "psi31"}), {"--support"}));
  EXPECT_TRUE(exited(run({"--kernel", "elastic", "--core-radius", "2", "--poisson", "0.3"}), 0));
}

TEST(DeformTool, OverwritesNothingUnlessToldToAndNeverItsInput) {
  const TempFolder folder;
  const std::string l = folder.write("l.csv", "x,y,z,dx,dy,dz\n0,0,0,1,0,0\n");
  const std::string p = folder.write("p.csv", "x,y,z\n1,0,0\n"), out = (folder / "o.csv").string();
  const auto deform = [&](const std::string& to, std::vector<std::string> more = {}) {
    std::vector<std::string> line = {"deform",    "--landmarks", l,       "--points", p,
                                     "--support", "12",          "--out", to};
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  };
  EXPECT_TRUE(exited(deform(out), 0));
  const std::string first = read_file(out);
  EXPECT_TRUE(refused_in_one_line(deform(out), {out, "exists", "--force"}));
  EXPECT_TRUE(exited(deform(out, {"--force"}), 0));
  for (const std::string& input : {l, p})
    EXPECT_TRUE(refused_in_one_line(deform(input, {"--force"}), {"is an input"}));
  EXPECT_EQ(read_file(p), "x,y,z\n1,0,0\n");
  EXPECT_EQ(read_file(out), first);
}

}  // namespace
}  // namespace brachy
