// Slices of `brachy compare` and `brachy stability`, run separately and merged, against the run that was not sliced.
#include <algorithm>
#include <functional>
#include <numeric>
#include <set>

#include "apps/lab/compare/compare_slices.h"
#include "apps/lab/stability/stability_slices.h"
#include "test_paths.h"
#include "tests/apps/apps_testing.h"
#include "tests/reference_files.h"

namespace brachy {
namespace {

using namespace test;
using Json = nlohmann::json;
namespace fs = std::filesystem;

struct Slices : ::testing::Test {
  TempFolder folder;

  std::string file(const std::string& name) const { return (folder / name).string(); }
  /// The files of slices 1/n … n/n.
  std::vector<std::string> sliced(const std::vector<std::string>& line, int n) const {
    std::vector<std::string> files;
    for (int i = 1; i <= n; ++i) {
      const Slice slice{i, n};
      files.push_back(file("slice" + std::to_string(i) + "of" + std::to_string(n) + ".json"));
      std::vector<std::string> all = line;
      all.insert(all.end(), {"--slice", to_string(slice), "--json", files.back()});
      EXPECT_TRUE(exited(run_brachy(all), 0)) << to_string(slice);
    }
    return files;
  }
  static Ended merge(const std::string& tool, const std::vector<std::string>& files,
                     const std::vector<std::string>& more = {}) {
    std::vector<std::string> line = {tool, "--merge"};
    line.insert(line.end(), files.begin(), files.end());
    line.insert(line.end(), more.begin(), more.end());
    return run_brachy(line);
  }
  /// A slice's file with one thing changed.
  std::string changed(const std::string& from, const std::string& name,
                      const std::function<void(Json&)>& change) const {
    Json json = Json::parse(read_file(from));
    change(json);
    return folder.write(name, json.dump());
  }
};

/// The reproducible part: everything except times, and memory, which depends on what ran before.
Json without_measurements(Json rows) {
  for (Json& row : rows)
    for (const char* key : {"setup_ms", "tick_ms", "advance_ms", "bytes", "slice"}) row.erase(key);
  return rows;
}

TEST(Slice, IsWrittenAsIOfN) {
  EXPECT_EQ(to_string(find_slice("2/8").value()), "2/8");
  EXPECT_EQ(to_string(find_slice("1/1").value()), "1/1");
  for (const char* wrong : {"", "/", "x", "3", "0/3", "4/3", "-1/3", "1/-3", "1/0", "1/3/5", " 1/3", "1/3 ",
                            "1.0/3", "2/", "/2", "1/99999999999"})
    EXPECT_FALSE(find_slice(wrong)) << wrong;
}

TEST(Slice, EveryRowOfAComparisonIsInOneSliceAndNoneHasMuchMore) {
  constexpr int kSceneCount = 11, kModelCount = 60;
  for (const int n : {1, 2, 3, 8, 60, 100}) {
    std::vector<int> rows(static_cast<std::size_t>(n));
    std::vector<std::set<int>> of_a_model(static_cast<std::size_t>(n));
    for (int s = 0; s < kSceneCount; ++s)
      for (int m = 0; m < kModelCount; ++m)
        for (int i = 1; i <= n; ++i)
          if (ComparePlan::has_row({i, n}, static_cast<std::size_t>(s), static_cast<std::size_t>(m)))
            ++rows[static_cast<std::size_t>(i - 1)], of_a_model[static_cast<std::size_t>(i - 1)].insert(m);
    EXPECT_EQ(std::accumulate(rows.begin(), rows.end(), 0), kSceneCount * kModelCount) << n;
    EXPECT_LE(std::ranges::max(rows) - std::ranges::min(rows), kSceneCount) << n;
  }
}

TEST(Slice, EverySweepIsInOneSliceAndTheLongestIsAlone) {
  const std::vector<Sweep> all(all_sweeps().begin(), all_sweeps().end());
  for (const int n : {1, 2, 4, 10, 15}) {
    std::multiset<std::string> names;
    for (int i = 1; i <= n; ++i)
      for (const Sweep& sweep : sweeps_of({i, n}, all)) names.insert(sweep.name);
    EXPECT_EQ(names.size(), all.size()) << n;
    for (const Sweep& sweep : all) EXPECT_EQ(names.count(sweep.name), 1u) << n << ", " << sweep.name;
  }
  EXPECT_EQ(sweeps_of({1, 4}, all).size(), 1u);
  EXPECT_TRUE(sweeps_of({15, 15}, all).empty());
}

TEST_F(Slices, OfAComparisonMergeToTheRunThatWasNotSliced) {
  const std::vector<std::string> line = {
      "compare",      "--quick",
      "--references", kReferences.string(),
      "--models",     "psi31_a12,psi30_a24,compact_elastic,mass_spring_8mm",
      "--scenes",     "lateral,neo_hookean"};
  std::vector<std::string> whole = line;
  whole.insert(whole.end(), {"--json", file("whole.json")});
  const Ended unsliced = run_brachy(whole);
  ASSERT_TRUE(exited(unsliced, 0));
  std::vector<std::string> files = sliced(line, 3);
  std::rotate(files.begin(), files.begin() + 1, files.end());  // in whatever order
  const Ended merged =
      merge("compare", files, {"--json", file("merged.json"), "--markdown", file("merged.md")});
  ASSERT_TRUE(exited(merged, 0));

  const Json one = Json::parse(read_file(file("whole.json"))),
             other = Json::parse(read_file(file("merged.json")));
  ASSERT_GT(one.at("rows").size(), 12u);
  EXPECT_EQ(without_measurements(one.at("rows")), without_measurements(other.at("rows")));
  EXPECT_EQ(one.at("quick"), other.at("quick"));
  EXPECT_EQ(one.at("simd"), other.at("simd"));
  std::set<int> slices;
  for (const Json& row : other.at("rows")) slices.insert(row.at("slice").get<int>());
  EXPECT_EQ(slices, (std::set{1, 2, 3}));

  // The table: the same models in the same order, the same errors (five columns of seven that are not times or memory).
  const auto lines = lines_of(unsliced.out), its = lines_of(merged.out);
  ASSERT_EQ(its.size(), lines.size() + 2);  // a sentence on times below
  const auto before_times = [](const std::string& row) {
    std::size_t at = 0;
    for (int bars = 0; at < row.size() && bars < 8; ++at) bars += row[at] == '|';
    return row.substr(0, at);
  };
  for (std::size_t i = 0; i < lines.size(); ++i) EXPECT_EQ(before_times(its[i]), before_times(lines[i]));
  EXPECT_NE(its.back().find("paper_csrbf_psi31_a12"), std::string::npos) << its.back();
  EXPECT_NE(its.back().find("the 3 slices"), std::string::npos) << its.back();
  EXPECT_EQ(read_file(file("merged.md")), merged.out);
  EXPECT_EQ(other.at("yardstick_ms").size(), 3u);
}

TEST_F(Slices, OfStabilityMergeToTheRunThatWasNotSliced) {
  const std::vector<std::string> line = {"stability", "--quick", "--sweeps",
                                         "plane,anchor,time_step,lattice,coplanar"};
  std::vector<std::string> whole = line;
  whole.insert(whole.end(), {"--json", file("whole.json"), "--out", file("whole")});
  const Ended unsliced = run_brachy(whole);
  ASSERT_TRUE(exited(unsliced, 0));
  const Ended merged =
      merge("stability", sliced(line, 3), {"--json", file("merged.json"), "--out", file("merged")});
  ASSERT_TRUE(exited(merged, 0));
  EXPECT_EQ(merged.out, unsliced.out);
  EXPECT_EQ(read_file(file("merged.json")), read_file(file("whole.json")));
  for (const char* name : {"stability.md", "curves.csv", "plane.csv"})
    EXPECT_EQ(read_file(folder / "merged" / name), read_file(folder / "whole" / name)) << name;
  // More slices than sweeps: the last ones are empty, and valid.
  EXPECT_TRUE(exited(merge("stability", sliced({"stability", "--quick", "--sweeps", "time_step"}, 2)), 0));
}

TEST_F(Slices, AreNamedWhereTheyAreMissingTwiceOrOfAnotherRun) {
  const std::vector<std::string> line = {"stability", "--quick", "--sweeps", "time_step,coplanar"};
  const auto three = sliced(line, 3), two = sliced(line, 2);
  EXPECT_TRUE(refused_in_one_line(merge("stability", {three[0]}), {"3 slices", "missing: 2, 3"}));
  EXPECT_TRUE(refused_in_one_line(merge("stability", {three[2], three[0]}), {"missing: 2"}));
  EXPECT_TRUE(refused_in_one_line(merge("stability", {three[0], three[1], three[1], three[2]}),
                                  {"slice2of3.json", "both are slice 2/3"}));
  EXPECT_TRUE(refused_in_one_line(merge("stability", {three[0], two[1]}), {"slice2of2.json", "of 2 slices"}));
  EXPECT_TRUE(refused_in_one_line(merge("compare", {three[0]}),
                                  {"slice1of3.json", "not a slice of `brachy compare`"}));
  EXPECT_TRUE(refused_in_one_line(merge("stability", {file("none.json")}), {"none.json"}));
  const std::string text = read_file(two[1]);
  EXPECT_TRUE(refused_in_one_line(
      merge("stability", {two[0], folder.write("cut.json", text.substr(0, text.size() / 2))}),
      {"cut.json", "truncated"}));
  for (const auto& [key, value] : std::vector<std::pair<std::string, Json>>{{"simd", "vax"},
                                                                            {"version", "0.0.9"},
                                                                            {"quick", false},
                                                                            {"scene", "name = 1"},
                                                                            {"sweeps", {"push"}}})
    EXPECT_TRUE(refused_in_one_line(
        merge("stability",
              {two[0], changed(two[1], key + ".json",
                               [&, key = key, value = value](Json& json) { json["run"][key] = value; })}),
        {key + ".json", "another run", key}));
  EXPECT_TRUE(refused_in_one_line(
      merge("stability",
            {two[0], changed(two[1], "less.json", [](Json& json) { json["parts"] = Json::object(); })}),
      {"no slice has the sweep"}));
  EXPECT_TRUE(refused_in_one_line(
      merge("stability", {two[0], changed(two[1], "odd.json", [](Json& json) { json["parts"] = 7; })}),
      {"--merge"}));
}

TEST_F(Slices, ThatAreNoneAreRefused) {
  for (const char* tool : {"compare", "stability"}) {
    for (const char* wrong : {"0/3", "4/3", "x"}) {
      const Ended ended = run_brachy({tool, "--quick", "--slice", wrong, "--json", file("x.json")});
      EXPECT_TRUE(exited(ended, 2)) << wrong;
      EXPECT_NE(ended.err.find("needs I/N"), std::string::npos) << ended.err;
    }
    EXPECT_TRUE(exited(run_brachy({tool, "--quick", "--slice", "1/3"}), 2)) << "where to?";
    EXPECT_TRUE(exited(run_brachy({tool, "--quick", "--merge", file("x.json")}), 2));
    EXPECT_TRUE(exited(run_brachy({tool, "--merge"}), 2));
  }
}

// The script that sbatch takes, with the environment of one task of an array; no Slurm is needed.
struct SlurmScript : Slices {
  Ended task(const std::vector<std::string>& environment) const {
    std::vector<std::string> line = {"/usr/bin/env", std::string("BRACHY=") + BRACHY_BINARY};
    line.insert(line.end(), environment.begin(), environment.end());
    const std::string script = (kConfigFolder.parent_path() / "scripts/campaigns/sweep.slurm").string();
    line.insert(line.end(),
                {"/bin/bash", script, "stability", file("out"), "--quick", "--sweeps", "time_step,coplanar"});
    return run_process(line);
  }
};

TEST_F(SlurmScript, RunsASliceATaskAndSaysHowToMerge) {
  for (const char* id : {"1", "2"}) {
    const Ended ended = task({std::string("SLURM_ARRAY_TASK_ID=") + id, "SLURM_ARRAY_TASK_COUNT=2",
                              "SLURM_ARRAY_TASK_MIN=1", "SLURM_ARRAY_TASK_MAX=2"});
    ASSERT_TRUE(exited(ended, 0));
    EXPECT_NE(ended.out.find("brachy stability --merge"), std::string::npos) << ended.out;
  }
  EXPECT_TRUE(exited(merge("stability", {file("out/1.json"), file("out/2.json")}), 0));
  // One task again, as an array of one: the number of slices must be given.
  const std::vector<std::string> again = {"SLURM_ARRAY_TASK_ID=2", "SLURM_ARRAY_TASK_COUNT=1",
                                          "SLURM_ARRAY_TASK_MIN=2", "SLURM_ARRAY_TASK_MAX=2"};
  const Ended refused = task(again);
  EXPECT_TRUE(exited(refused, 2));
  EXPECT_NE(refused.err.find("BRACHY_SLICES"), std::string::npos) << refused.err;
  std::vector<std::string> told = again;
  told.emplace_back("BRACHY_SLICES=2");
  EXPECT_TRUE(exited(task(told), 0));
  EXPECT_TRUE(exited(task({}), 2)) << "without an array";
}

}  // namespace
}  // namespace brachy
