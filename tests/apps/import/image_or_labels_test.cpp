#include "apps/import/labels/image_or_labels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "apps/import/labels/meta_image.h"
#include "core/base/error.h"
#include "core/geometry/label_map/label_nrrd.h"

namespace brachy {
namespace {

LabelMap map_of(const std::function<double(const Vec3&)>& value) {
  LabelMap map;
  map.grid.size = {40, 36, 32};
  auto& labels = map.layers.emplace_back();
  for (int k = 0; k < 32; ++k)
    for (int j = 0; j < 36; ++j)
      for (int i = 0; i < 40; ++i)
        labels.push_back(static_cast<std::uint16_t>(std::lround(value(Vec3(i, j, k)))));
  add_segments_by_value(map);
  return map;
}

/// `count` balls of values `first`, first + step, …, and 0 around.
LabelMap balls(int count, int first, int step, double radius = 4) {
  return map_of([&](const Vec3& p) {
    for (int n = 0; n < count; ++n)
      if ((p - Vec3(5 + 9 * (n % 4), 5 + 9 * (n / 4 % 3), 5 + 9 * (n / 12))).norm() < radius)
        return first + n * step;
    return 0;
  });
}

TEST(ImageOrLabels, PiecesOnABackgroundAreLabels) {
  EXPECT_EQ(image_reason(balls(1, 1, 1), "a.nrrd"), "");
  EXPECT_EQ(image_reason(balls(1, 1000, 1), "ct.nrrd"), "");  // a mask, whatever its name
  EXPECT_EQ(image_reason(balls(3, 1, 1, 2), "a.nrrd"), "");
  EXPECT_EQ(image_reason(balls(24, 1, 1), "a.nrrd"), "");
  EXPECT_EQ(image_reason(balls(24, 10, 97), "a.nrrd"), "");
}

TEST(ImageOrLabels, NoiseAndSlopesAreImages) {
  std::mt19937 random(1);
  std::gamma_distribution<double> speckle(3, 20);
  const auto echoes = [&](const Vec3&) { return std::min(255.0, speckle(random)); };
  EXPECT_NE(image_reason(map_of(echoes), "a.nrrd"), "");
  EXPECT_NE(image_reason(map_of([&](const Vec3& p) { return p.x() < 20 ? 0 : echoes(p); }), "a.nrrd"), "");
  // Few bits, and slopes along one axis or all.
  EXPECT_NE(image_reason(map_of([&](const Vec3& p) { return std::floor(echoes(p) / 40); }), "a.nrrd"), "");
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NE(image_reason(map_of([&](const Vec3& p) { return 10 * p[axis]; }), "a.nrrd"), "") << axis;
  EXPECT_NE(image_reason(map_of([&](const Vec3& p) { return 100 + 40 * std::sin(0.2 * p.sum()); }), "a.nrrd"),
            "");
}

TEST(ImageOrLabels, WhatTheFileSaysComesFirstThenItsName) {
  LabelMap noise = map_of([](const Vec3& p) { return std::fmod(31 * p.x() + 17 * p.y() + 7 * p.z(), 97); });
  EXPECT_NE(image_reason(noise, "a.nrrd"), "");
  EXPECT_EQ(image_reason(noise, "case_7_seg.nrrd"), "");
  noise.is_declared = true;
  EXPECT_EQ(image_reason(noise, "ct.nrrd"), "");
  for (const char* name : {"x/ct.nii.gz", "MR_T2.nrrd", "us volume.mha", "image.nrrd"})
    EXPECT_EQ(image_reason(balls(5, 1, 1), name), "by its name") << name;
  EXPECT_EQ(image_reason(balls(5, 1, 1), "ct_segmentation.nii"), "");
}

TEST(MetaImage, LiesWhereItsHeaderSays) {
  const std::string head =
      "ObjectType = Image\nNDims = 3\nBinaryDataByteOrderMSB = False\nTransformMatrix = 0 1 0 -1 0 0 0 0 1\n"
      "Offset = 10 20 30\nElementSpacing = 0.5 2 3\nDimSize = 2 1 2\n";
  const std::string file =
      head + "ElementType = MET_UCHAR\r\nElementDataFile = LOCAL\n" + std::string("\0\1\2\0", 4);
  const NrrdHeader header = parse_meta_header(file, "m.mha", kLabelLimits);
  EXPECT_LT((header.grid.position({0, 0, 0}) - Vec3(-10, -20, 30)).norm(), 1e-12);
  EXPECT_LT((header.grid.position({1, 0, 0}) - Vec3(-10, -20.5, 30)).norm(), 1e-12);
  EXPECT_LT((header.grid.position({0, 1, 0}) - Vec3(-8, -20, 30)).norm(), 1e-12);
  EXPECT_LT((header.grid.position({0, 0, 1}) - Vec3(-10, -20, 33)).norm(), 1e-12);
  const LabelMap map = read_label_volume(header, file, "m.mha");
  EXPECT_EQ(map.layers.front(), (std::vector<std::uint16_t>{0, 1, 2, 0}));
  const std::pair<std::string, const char*> wrong[] = {
      {head, "ElementDataFile"},
      {head + "ElementType = MET_UCHAR\nElementDataFile = other.raw\n", "another file"},
      {head + "ElementType = MET_STRING\nElementDataFile = LOCAL\n", "MET_STRING"},
      {"NDims = 2\nElementDataFile = LOCAL\n", "NDims"},
      {"NDims = 3\nDimSize = 99999 99999 99999\nOffset = 0 0 0\nElementSpacing = 1 1 1\nElementType = "
       "MET_UCHAR\n"
       "ElementDataFile = LOCAL\n",
       "voxels"},
      {head + "ElementSpacing = 0 1 1\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n",
       "TransformMatrix"},
      {head + "DimSize = 2 nan 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n", "DimSize"}};
  for (const auto& [text, words] : wrong) try {
      parse_meta_header(text, "m.mha", kLabelLimits);
      ADD_FAILURE() << text;
    } catch (const UserError& e) {
      EXPECT_EQ(std::string(e.what()).find("m.mha: "), 0u) << e.what();
      EXPECT_NE(std::string(e.what()).find(words), std::string::npos) << e.what();
    }
}

}  // namespace
}  // namespace brachy
