#include "net/igtl/needle_name.h"

#include <gtest/gtest.h>

namespace brachy::net::igtl {
namespace {

TEST(IgtlNeedleName, IsNeedleWithAnyFrameBehindIt) {
  EXPECT_EQ(needle_of("NeedleToRas"), 0);
  EXPECT_EQ(needle_of("NeedleToWorld"), 0);
  EXPECT_EQ(needle_of("Needle"), 0);
  EXPECT_EQ(needle_of("NeedleTipToReference"), 0);
  EXPECT_EQ(needle_of("Needle2ToRas"), 2);
  EXPECT_EQ(needle_of("NeedleTip15ToTracker"), 15);
}

TEST(IgtlNeedleName, IsNoOtherTool) {
  for (const char* other :
       {"", "Tracker", "ForceToRas", "StylusToReference", "needleToRas", "NeedleGuideToRas", "Needle-1ToRas",
        "Needle65535ToRas", "Needle65536ToRas", "ReferenceToNeedle", "BentTipToRas", "BentTip2ToRas"})
    EXPECT_EQ(needle_of(other), std::nullopt) << other;
}

TEST(IgtlNeedleName, WhatIsSentFitsTheHeaderAndIsUnderstood) {
  EXPECT_EQ(pose_name(0, 1), "NeedleToRas");
  EXPECT_EQ(force_name(0, 1), "ForceToRas");
  EXPECT_EQ(pose_name(0, 2), "Needle0ToRas");
  EXPECT_EQ(force_name(15, 16), "Force15ToRas");
  EXPECT_EQ(bent_tip_name(0, 1), "BentTipToRas");
  EXPECT_EQ(bent_tip_name(15, 16), "BentTip15ToRas");
  EXPECT_LE(pose_name(1023, 1024).size(), 20u);
  EXPECT_LE(bent_tip_name(1023, 1024).size(), 20u);
  EXPECT_EQ(needle_of(pose_name(1023, 1024)), 1023);
}

}  // namespace
}  // namespace brachy::net::igtl
