// Echoes from a patient's volume in place of made-up tissue.
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/scene/file/scene_file.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/core/ultrasound/ultrasound_testing.h"

namespace brachy {
namespace {

using test::FunctionField;
using test::plain_options;
using test::pressure_at;

constexpr double kDbPerValue = 0.5, kHalfMm = 36;

// Dark for x < 0, 20 dB brighter beyond: on an oblique grid of uneven steps, its columns flipped.
Volume two_halves() {
  VoxelGrid grid;
  grid.steps = Eigen::AngleAxisd(0.3, Vec3(1, 2, -1).normalized()).toRotationMatrix() *
               Eigen::DiagonalMatrix<double, 3>(-0.5, 0.8, 1.5);
  grid.size = {150, 95, 50};
  grid.origin = -grid.steps * Vec3(74.5, 47, 24.5);
  std::vector<float> values;
  for (std::size_t k = 0; k < grid.size[2]; ++k)
    for (std::size_t j = 0; j < grid.size[1]; ++j)
      for (std::size_t i = 0; i < grid.size[0]; ++i)
        values.push_back(
            grid.position(Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k))).x() <
                    0
                ? 100
                : 140);
  return {grid, values};
}

std::vector<Structure> phantom_structures() {
  return load_structures(parse_scene("[tissue]\npoints = 2000\n", "scene.toml"));
}

float texture_db(const EchoMap& echoes, const Vec3& X) {
  EchoPlaces place;
  place.count = 1;
  place.x[0] = static_cast<float>(X.x());
  place.y[0] = static_cast<float>(X.y());
  place.z[0] = static_cast<float>(X.z());
  EchoTissues tissues;
  echoes.at(place, scan_loops(best_simd_target()), tissues);
  return tissues.texture_db[0];
}

// The mean level of what is drawn between two x and |y| < 10, dB.
double level_between(const UltrasoundImager& imager, double from_x, double to_x) {
  const ImagePlane& plane = imager.plane();
  const RigidTransform X_WI = test::probe_below() * plane.in_probe();
  double sum = 0;
  int n = 0;
  for (std::size_t line = 0; line < plane.lines(); line += 2)
    for (std::size_t sample = 0; sample < imager.samples_per_line(); sample += 4) {
      const PlanePoint p =
          plane.at(static_cast<double>(line), static_cast<double>(sample) * imager.sample_mm());
      const Vec3 y = X_WI * Vec3(p.a, p.b, 0);
      if (y.x() < from_x || y.x() > to_x || std::abs(y.y()) > 10) continue;
      sum += std::pow(pressure_at(imager, line, sample), 2);
      ++n;
    }
  EXPECT_GT(n, 500);
  return 10 * std::log10(sum / n);
}

TEST(VolumeEchoes, HaveTheLevelsOfTheVolumeAboutTheGlandsMean) {
  UltrasoundImager imager(plain_options("transverse"),
                          std::make_shared<EchoMap>(phantom_structures(), two_halves(), kDbPerValue));
  FunctionField rest([](const Vec3&) { return Vec3(Vec3::Zero()); });
  ASSERT_EQ(test::render(imager, rest), ImageResult::kNew);
  const double dark = level_between(imager, -14, -3), bright = level_between(imager, 3, 14);
  EXPECT_NEAR(bright - dark, 20, 1);
  EXPECT_NEAR(dark, -10, 1.2);  // the phantom is as wide on both sides
}

TEST(VolumeEchoes, MoveWithTheTissue) {
  UltrasoundImager imager(plain_options("transverse"),
                          std::make_shared<EchoMap>(phantom_structures(), two_halves(), kDbPerValue));
  FunctionField moved([](const Vec3&) { return Vec3(8, 0, 0); });
  ASSERT_EQ(test::render(imager, moved), ImageResult::kNew);
  EXPECT_NEAR(level_between(imager, -4, 5), -10, 1.2);
  EXPECT_NEAR(level_between(imager, 11, 18), 10, 1.2);
}

TEST(VolumeEchoes, AreNoneBeyondTheVolume) {
  const EchoMap echoes(phantom_structures(), two_halves(), kDbPerValue);
  EXPECT_FALSE(echoes.is_uniform());
  EXPECT_NEAR(texture_db(echoes, Vec3(10, 0, 0)), 10, 0.5);
  EXPECT_LT(texture_db(echoes, Vec3(10, 0, 3 * kHalfMm)), -80);
}

TEST(VolumeEchoes, OfAnotherPlaceAreRefusedWithBothPlaces) {
  VoxelGrid grid;
  grid.size = {10, 10, 10};
  grid.origin = Vec3(100, 0, 0);
  try {
    EchoMap(phantom_structures(), Volume(grid, std::vector<float>(1000, 1)), 1);
    FAIL() << "accepted";
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("(104.5, 4.5, 4.5) mm, the prostate's at"), std::string::npos)
        << e.what();
  }
}

TEST(VolumeEchoes, AreReadFromTheFileThatTheSceneNames) {
  const test::TempFile file(
      "us.nrrd",
      "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 3 3 3\n"
      "space directions: (30,0,0) (0,30,0) (0,0,30)\nspace origin: (-30,-30,-30)\nencoding: ascii\n\n"
      "9 9 1 9 9 1 9 9 1 9 9 1 9 9 1 9 9 1 9 9 1 9 9 1 9 9 1\n");
  const auto scene_with = [](const std::string& volume) {
    return parse_scene(
        "[tissue]\npoints = 2000\n[ultrasound]\nvolume = \"" + volume + "\"\nvolume_db_per_value = 2\n",
        "scene.toml");
  };
  const Scene scene = scene_with(file.path().string());
  const auto echoes = load_echo_map(scene, load_structures(scene));
  // Left is +x in the file and -x in the world.
  EXPECT_NEAR(texture_db(*echoes, Vec3(25, 0, 0)) - texture_db(*echoes, Vec3(-30, 0, 0)), 16, 3);
  const Scene other = scene_with("none.nrrd");
  try {
    load_echo_map(other, load_structures(other));
    FAIL() << "accepted";
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("none.nrrd"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace brachy
