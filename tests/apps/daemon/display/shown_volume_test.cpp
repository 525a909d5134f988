#include "apps/daemon/display/shown_volume.h"

#include <gtest/gtest.h>

#include <numeric>

#include "core/geometry/volume/nrrd_file.h"

namespace brachy {
namespace {

/// Values 0, 1, 2, … on a grid of 1 × 1 × 2 mm from the origin on.
Volume counted(std::array<std::size_t, 3> size) {
  VoxelGrid grid{size, Vec3::Zero(), Vec3(1, 1, 2).asDiagonal()};
  std::vector<float> values(grid.count());
  std::iota(values.begin(), values.end(), 0.0F);
  return {grid, std::move(values)};
}

TEST(ShownVolume, IsThePartWithinTheBoxWhereItLies) {
  const Volume whole = counted({10, 8, 6});
  const auto part = shown_part(whole, {1.5, 2, 3}, {4.5, 20, 9});
  ASSERT_TRUE(part);
  EXPECT_EQ(part->grid().size, (std::array<std::size_t, 3>{3, 6, 3}));
  EXPECT_EQ(part->grid().origin, Vec3(2, 2, 4));
  for (const Vec3& X : {Vec3(2, 2, 4), Vec3(4, 7, 8), Vec3(3, 5, 6)})
    EXPECT_EQ(part->nearest(X), whole.nearest(X));
  EXPECT_FALSE(shown_part(whole, {20, 0, 0}, {30, 8, 8}));
  EXPECT_FALSE(shown_part(whole, {1.2, 0, 0}, {1.8, 8, 8})) << "between two voxels";
}

TEST(ShownVolume, OfAnObliqueVolumeHoldsTheBoxToAVoxel) {
  VoxelGrid grid{{40, 40, 40}, Vec3(-20, -20, -20), Mat3::Identity()};
  grid.steps = Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  grid.origin = grid.steps * Vec3::Constant(-19.5);
  const Volume whole(grid, std::vector<float>(grid.count(), 1));
  const auto part = shown_part(whole, Vec3::Constant(-5), Vec3::Constant(5));
  ASSERT_TRUE(part);
  EXPECT_LT(part->grid().count(), grid.count() / 4);
  for (int corner = 0; corner < 8; ++corner)
    EXPECT_TRUE(part->contains(
        Vec3((corner & 1) != 0 ? 4 : -4, (corner & 2) != 0 ? 4 : -4, (corner & 4) != 0 ? 4 : -4)));
}

TEST(ShownVolume, HasAtMostSoManyVoxelsWhosePlacesAndMeanStay) {
  const Volume whole = counted({40, 40, 20});
  const auto part = shown_part(whole, Vec3::Constant(-1), Vec3::Constant(100), 5000);
  ASSERT_TRUE(part);
  EXPECT_LE(part->grid().count(), 5000U);
  EXPECT_GE(part->grid().count(), 2000U);
  const Vec3 at(20, 20, 20);
  EXPECT_NEAR(part->at(at), whole.at(at), 1);
}

TEST(ShownVolume, ComesBackFromItsTextToHalfAStepOfItsWords) {
  const Volume whole = counted({10, 8, 6});
  const std::string text = shown_text(whole);
  const NrrdHeader header = parse_nrrd_header(text, "volume");
  EXPECT_EQ(header.grid.size, whole.grid().size);
  EXPECT_EQ(header.grid.steps, whole.grid().steps);
  const double least = std::stod(header.keys.at("value_least")),
               step = std::stod(header.keys.at("value_step"));
  const NrrdVolume back = parse_nrrd(text, "volume");
  for (std::size_t n = 0; n < whole.values().size(); ++n)
    ASSERT_NEAR(least + step * double{back.volume.values()[n]}, whole.values()[n], 0.51 * step);
  EXPECT_NEAR(std::stod(header.keys.at("window_least")), 4.8, 1);
  EXPECT_NEAR(std::stod(header.keys.at("window_most")), 474, 1);
}

TEST(ShownVolume, OfOneValueIsThatValue) {
  const Volume even({{2, 2, 2}, Vec3::Zero(), Mat3::Identity()}, std::vector<float>(8, -7));
  const std::string text = shown_text(even);
  EXPECT_EQ(parse_nrrd_header(text, "volume").keys.at("value_least"), "-7");
  const NrrdVolume back = parse_nrrd(text, "volume");
  for (const float word : back.volume.values()) EXPECT_EQ(word, 0);
}

}  // namespace
}  // namespace brachy
