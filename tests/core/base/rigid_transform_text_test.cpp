#include "core/base/rigid_transform_text.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

TEST(RigidTransformText, IsReadRowByRow) {
  const auto X = rigid_transform_from("0 -1 0 10, 1 0 0 20  0,0,1,-3.5");
  ASSERT_TRUE(X);
  EXPECT_EQ(X->p, Vec3(10, 20, -3.5));
  EXPECT_EQ(*X * Vec3(1, 0, 0), Vec3(10, 21, -3.5));
  EXPECT_EQ(rigid_transform_from("1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), RigidTransform());
}

TEST(RigidTransformText, ARotationOfFewDigitsIsMadeExact) {
  const auto X = rigid_transform_from("0.7071 -0.7071 0 0  0.7071 0.7071 0 0  0 0 1 0");
  ASSERT_TRUE(X);
  EXPECT_LT(rigidity_error(*X), 1e-12);
}

TEST(RigidTransformText, WhatIsNoneIsNotRead) {
  for (const char* none : {"", "1 0 0 0", "1 0 0 0 0 1 0 0 0 0 1 0 0", "1 0 0 0 0 1 0 0 0 0 1 x",
                           "1 0 0 nan 0 1 0 0 0 0 1 0", "2 0 0 0 0 1 0 0 0 0 1 0", "-1 0 0 0 0 1 0 0 0 0 1 0",
                           "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 2", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 0"})
    EXPECT_FALSE(rigid_transform_from(none)) << none;
}

}  // namespace
}  // namespace brachy
