// `brachy us`: images of a trajectory as files.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

const std::string kSmallImage = "\n[ultrasound]\nwidth_px = 96\nheight_px = 64\nlines = 64\n";

TEST(UsTool, WritesTheSameFilesForAnyNumberOfThreadsAndOverwritesNone) {
  const TempFolder folder;
  const std::string scene = folder.write("scene.toml", small_scene(kSmallImage));
  const std::string motion = folder.write("motion.csv", short_insertion(0.3));
  std::string first;
  for (const char* threads : {"1", "2"}) {
    const std::filesystem::path out = folder / (std::string("out") + threads);
    const Ended ended = run_brachy({"us", "--config", scene, "--trajectory", motion, "--arrays",
                                    "transverse,sagittal", "--every-s", "0.1", "--format", "both",
                                    "--threads", threads, "--out", out.string(), "--json"});
    ASSERT_TRUE(exited(ended, 0)) << ended.err;
    const nlohmann::json json = json_of(ended);
    EXPECT_EQ(json["images"].get<int>() % 2, 0);
    EXPECT_GE(json["images"].get<int>(), 4);
    EXPECT_LE(json["worst_residual_mm"].get<double>(), 0.02);
    const std::string png = read_file(out / "transverse_000000.png"),
                      nrrd = read_file(out / "sagittal_000000.nrrd");
    EXPECT_EQ(png.substr(1, 3), "PNG");
    EXPECT_EQ(png.substr(16, 8), std::string("\0\0\0\x60\0\0\0\x40", 8));
    EXPECT_EQ(nrrd.substr(0, 9), "NRRD0005\n");
    EXPECT_NE(nrrd.find("sizes: 96 64 1\n"), std::string::npos);
    EXPECT_EQ(nrrd.size() - nrrd.find("\n\n") - 2, 96u * 64u);
    if (first.empty()) first = png + nrrd;
    EXPECT_TRUE(first == png + nrrd);
    EXPECT_TRUE(refused_in_one_line(run_brachy({"us", "--config", scene, "--out", out.string()}), {"--out"}));
  }
}

TEST(UsTool, RefusesWhatItCannotImage) {
  const TempFolder folder;
  const std::string out = (folder / "out").string();
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"us", "--arrays", "round", "--out", out}), {"round", "sagittal"}));
  EXPECT_TRUE(refused_in_one_line(run_brachy({"us", "--planned-seeds", "--out", out}), {"plan.file"}));
  const std::string scene = folder.write("scene.toml", small_scene("\n[ultrasound]\nplanes = 2\n"));
  EXPECT_TRUE(
      refused_in_one_line(run_brachy({"us", "--config", scene, "--out", out}), {"planes", "1, 3 or 5"}));
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace brachy
