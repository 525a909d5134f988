#include "net/igtl/content/needle_name.h"

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
  const Naming naming;
  EXPECT_EQ(naming.pose_name(0, 1), "NeedleToRas");
  EXPECT_EQ(naming.force_name(0, 1), "ForceToRas");
  EXPECT_EQ(naming.pose_name(0, 2), "Needle0ToRas");
  EXPECT_EQ(naming.force_name(15, 16), "Force15ToRas");
  EXPECT_EQ(naming.bent_tip_name(0, 1), "BentTipToRas");
  EXPECT_EQ(naming.bent_tip_name(15, 16), "BentTip15ToRas");
  EXPECT_EQ(naming.error_name(0, 1), "ErrorToRas");
  EXPECT_LE(naming.pose_name(1023, 1024).size(), 20u);
  EXPECT_LE(naming.bent_tip_name(1023, 1024).size(), 20u);
  EXPECT_EQ(needle_of(naming.pose_name(1023, 1024)), 1023);
  Naming longest;
  longest.frame = "Reference1";  // ten letters, the most that a scene may name
  EXPECT_LE(longest.bent_tip_name(15, 16).size(), 20u + 1u) << "cut by one: BentTip15ToReference";
  EXPECT_LE(longest.pose_name(15, 16).size(), 20u);
}

TEST(IgtlNeedleName, AProbeLeavesTheNeedlesTheirNames) {
  Naming naming;
  naming.probe = 1;
  EXPECT_EQ(naming.pose_name(0, 2), "NeedleToRas");
  EXPECT_EQ(naming.force_name(0, 2), "ForceToRas");
  EXPECT_EQ(naming.error_name(0, 2), "ErrorToRas");
  EXPECT_EQ(naming.shape_name(0, 2), "NeedleShape");
  EXPECT_EQ(naming.pose_name(1, 2), "ProbeToRas");
  for (const char* name : {"Probe", "ProbeToRas", "ProbeToReference"})
    EXPECT_EQ(naming.needle_of(name), 1) << name;
  EXPECT_EQ(naming.needle_of("NeedleToRas"), 0);
  for (const char* name : {"ProbeTip", "Prob", "Probe1ToRas"}) EXPECT_FALSE(naming.needle_of(name)) << name;
  EXPECT_FALSE(Naming().needle_of("ProbeToRas"));
  naming.probe = 3;
  EXPECT_EQ(naming.pose_name(2, 4), "Needle2ToRas");
  EXPECT_EQ(naming.pose_name(3, 4), "ProbeToRas");
}

TEST(IgtlNeedleName, NamesOfASceneMoveTheirNeedles) {
  Naming naming;
  naming.needle_names = names_in(" StylusTipToReference,, Probe ");
  EXPECT_EQ(naming.needle_of("StylusTipToReference"), 0);
  EXPECT_EQ(naming.needle_of("Probe"), 2);
  EXPECT_EQ(naming.needle_of(""), std::nullopt);
  EXPECT_EQ(naming.needle_of("Needle1ToRas"), 1) << "the usual names stay";
}

TEST(IgtlNeedleName, AFramesPosesAreThoseOfTheWorldAfterItsTransform) {
  Naming naming;
  const RigidTransform X{Eigen::AngleAxisd(0.3, Vec3(1, 2, 3).normalized()).toRotationMatrix(),
                         Vec3(1, 2, 3)};
  EXPECT_EQ(naming.to_world(X), X) << "RAS: the same bits";
  naming.X_WF.R = Vec3(-1, -1, 1).asDiagonal();  // LPS
  EXPECT_EQ(naming.to_world(X).p, Vec3(-1, -2, 3));
  naming.X_WF.p = Vec3(10, 20, 30);
  EXPECT_EQ(naming.to_world(X).p, Vec3(9, 18, 33));
  EXPECT_LT((naming.to_peer(naming.to_world(X)).p - X.p).norm(), 1e-12);
  EXPECT_LT((naming.to_peer(naming.to_world(X)).R - X.R).norm(), 1e-12);
}

}  // namespace
}  // namespace brachy::net::igtl
