#include "core/models/landmark_set.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "tests/core/simulation/allocation_guard.h"

namespace brachy {
namespace {

using Revision = LandmarkSet::Revision;

constexpr double kBelowTolerance = 0.6 * LandmarkSet::kRestToleranceMm;

/// A needle of four landmarks that bends, its tip last, in a body that gives way; what a tick may find elsewhere.
struct Needle {
  double tip_mm = 12, core_mm = 8, guide_mm = 110, arm_mm = 5, pushed_mm = 1;
  bool is_bent = true;

  void gather(LandmarkSet& landmarks) const {
    landmarks.clear();
    landmarks.add({20, 0, 0}, Vec3::Zero(), {});
    landmarks.anchors = 1;
    landmarks.compliance.set_body(Vec6::Constant(0.1));
    const std::int32_t beam =
        is_bent ? landmarks.compliance.add_beam(
                      {.length_mm = 200, .bending_stiffness_nmm2 = 15720, .guide_mm = guide_mm})
                : -1;
    for (std::uint32_t i = 0; i < 4; ++i) {
      const bool is_tip = i == 3;
      LandmarkSpread spread;
      if (is_tip) spread = {.core_mm = core_mm, .behind = 3};
      landmarks.add({0, 0, is_tip ? tip_mm : 3.0 * i}, {0, 0, pushed_mm}, spread,
                    {.beam = beam, .arc_mm = 150.0 + 3 * i, .arm = {arm_mm, 0, 0}});
      landmarks.owners.push_back({0, i});
    }
  }
  /// As a tick whose landmarks are solved.
  Revision tick(LandmarkSet& landmarks) const {
    gather(landmarks);
    landmarks.number();
    landmarks.settle();
    return landmarks.revision();
  }
};

std::set<std::uint64_t> numbers_of(const Revision& r) {
  return {r.positions, r.spreads, r.compliance, r.held, r.displacements};
}

TEST(LandmarkSet, EqualContentKeepsItsNumbers) {
  LandmarkSet landmarks;
  const Revision first = Needle{}.tick(landmarks);
  EXPECT_EQ(numbers_of(first).size(), 5u);
  EXPECT_FALSE(numbers_of(first).contains(0));
  for (int tick = 0; tick < 3; ++tick) EXPECT_EQ(Needle{}.tick(landmarks), first) << tick;
  // So has a set without landmarks.
  landmarks.assign({});
  const Revision none = landmarks.revision();
  EXPECT_NE(none.positions, first.positions);
  landmarks.assign({});
  EXPECT_EQ(landmarks.revision(), none);
}

// What was two ticks ago is new: a set remembers only what was settled last.
TEST(LandmarkSet, APartThatChangesHasAnotherNumberThanEverBefore) {
  LandmarkSet landmarks;
  std::set<std::uint64_t> seen;
  for (const double tip : {12.0, 12.1, 12.0, 12.1})
    EXPECT_TRUE(seen.insert(Needle{.tip_mm = tip}.tick(landmarks).positions).second) << tip;
}

TEST(LandmarkSet, EachPartHasItsOwnNumberAndDisplacementsAreThoseOfAllParts) {
  struct Change {
    const char* of;
    Needle needle;
    bool positions, spreads, compliance, held;
  };
  const Change changes[] = {
      {"tip", {.tip_mm = 12.5}, true, false, false, false},
      {"core", {.core_mm = 9}, false, true, false, false},
      {"guide", {.guide_mm = 111}, false, false, true, false},
      {"beam", {.is_bent = false}, false, false, true, false},
      {"body", {.arm_mm = 6}, false, false, true, true},
      {"push", {.pushed_mm = 1.5}, false, false, false, false},
  };
  for (const Change& change : changes) {
    SCOPED_TRACE(change.of);
    LandmarkSet landmarks;
    const Revision a = Needle{}.tick(landmarks), b = change.needle.tick(landmarks);
    EXPECT_EQ(b.positions != a.positions, change.positions);
    EXPECT_EQ(b.spreads != a.spreads, change.spreads);
    EXPECT_EQ(b.compliance != a.compliance, change.compliance);
    EXPECT_EQ(b.held != a.held, change.held);
    EXPECT_NE(b.displacements, a.displacements);
  }
}

TEST(LandmarkSet, DisplacementsWithinTheToleranceRestAndDoNotDrift) {
  LandmarkSet landmarks;
  const Revision first = Needle{}.tick(landmarks);
  EXPECT_EQ(Needle{.pushed_mm = 1 + kBelowTolerance}.tick(landmarks), first);
  EXPECT_EQ(Needle{.pushed_mm = 1 - kBelowTolerance}.tick(landmarks), first);
  // Steps below the tolerance that go on in one direction leave it.
  EXPECT_EQ(Needle{.pushed_mm = 1 + kBelowTolerance}.tick(landmarks), first);
  const Revision moved = Needle{.pushed_mm = 1 + 2 * kBelowTolerance}.tick(landmarks);
  EXPECT_NE(moved.displacements, first.displacements);
  EXPECT_EQ(moved.positions, first.positions);
  // From there the tolerance counts again.
  EXPECT_EQ(Needle{.pushed_mm = 1 + 3 * kBelowTolerance}.tick(landmarks), moved);
  EXPECT_NE(Needle{}.tick(landmarks), moved);
}

// Another shape is another reference for displacements: the tolerance begins again with it.
TEST(LandmarkSet, AnotherShapeTakesItsDisplacementsAsTheyAre) {
  LandmarkSet landmarks;
  Needle{}.tick(landmarks);
  const Revision other = Needle{.tip_mm = 13, .pushed_mm = 1 + kBelowTolerance}.tick(landmarks);
  EXPECT_EQ((Needle{.tip_mm = 13, .pushed_mm = 1 + 2 * kBelowTolerance}.tick(landmarks)), other);
}

TEST(LandmarkSet, WhatIsNoNumberIsNeverTheSame) {
  LandmarkSet landmarks;
  const Needle lost{.pushed_mm = std::numeric_limits<double>::quiet_NaN()};
  EXPECT_NE(lost.tick(landmarks).displacements, lost.tick(landmarks).displacements);
}

TEST(LandmarkSet, WhatWasNotSettledIsNotWhatLaterTicksAreComparedWith) {
  LandmarkSet landmarks;
  const Revision solved = Needle{}.tick(landmarks);
  const Needle unsolved{.tip_mm = 14, .core_mm = 4, .pushed_mm = 3};
  unsolved.gather(landmarks);
  landmarks.number();
  const std::uint64_t failed = landmarks.revision().positions;
  EXPECT_NE(failed, solved.positions);
  EXPECT_EQ(landmarks.revision().displacements, 0u);
  // The same once more, and then what was solved.
  unsolved.gather(landmarks);
  landmarks.number();
  EXPECT_NE(landmarks.revision().positions, failed);
  EXPECT_EQ(Needle{}.tick(landmarks), solved);
}

TEST(LandmarkSet, HasNoNumbersAfterAChange) {
  LandmarkSet landmarks;
  EXPECT_FALSE(landmarks.is_numbered());
  Needle{}.tick(landmarks);
  EXPECT_TRUE(landmarks.is_numbered());
  Needle{}.gather(landmarks);
  EXPECT_FALSE(landmarks.is_numbered());
  Needle{}.tick(landmarks);
  landmarks.positions[1].x() += 1e-12;  // without number()
  EXPECT_FALSE(landmarks.is_numbered());
}

TEST(LandmarkSet, RemovingALandmarkRemovesAllThatIsOfIt) {
  LandmarkSet landmarks;
  Needle{}.gather(landmarks);
  const auto remove = [&](std::size_t i) {
    for (auto* v : {&landmarks.positions, &landmarks.displacements})
      v->erase(v->begin() + static_cast<std::ptrdiff_t>(i));
    landmarks.remove(i);
  };
  remove(0);
  EXPECT_EQ(landmarks.anchors, 0u);
  EXPECT_EQ(landmarks.spreads.back().behind, 2);
  EXPECT_FALSE(landmarks.is_numbered());
  landmarks.number();
  landmarks.settle();
  const Revision before = landmarks.revision();
  remove(2);
  EXPECT_EQ(landmarks.spreads.back().behind, -1);
  EXPECT_EQ(landmarks.owners.back().index, 3u);
  EXPECT_EQ(landmarks.compliance.points().size(), 3u);
  EXPECT_FALSE(landmarks.is_numbered());
  landmarks.number();
  EXPECT_TRUE(landmarks.is_numbered());
  EXPECT_NE(landmarks.revision().positions, before.positions);
}

TEST(LandmarkSet, NoTwoSetsShareANumber) {
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 4; ++i) {
    LandmarkSet landmarks;
    seen.merge(numbers_of(Needle{}.tick(landmarks)));
    EXPECT_EQ(seen.size(), 5u * static_cast<std::size_t>(i + 1));
  }
  // A copy is of the same content, and so are its numbers, until either changes.
  LandmarkSet landmarks;
  const Revision common = Needle{}.tick(landmarks);
  LandmarkSet copy = landmarks;
  EXPECT_EQ(copy.revision(), common);
  const Needle moved{.tip_mm = 13};
  EXPECT_NE(moved.tick(landmarks).positions, moved.tick(copy).positions);
}

TEST(LandmarkSet, OfPositionsAloneIsAWholeSet) {
  const std::vector<Vec3> positions = {{1, 2, 3}, {4, 5, 6}};
  const LandmarkSet landmarks = LandmarkSet::of(positions);
  EXPECT_EQ(landmarks.positions, positions);
  EXPECT_EQ(landmarks.displacements, std::vector<Vec3>(2, Vec3::Zero()));
  EXPECT_EQ(landmarks.spreads, std::vector<LandmarkSpread>(2));
  EXPECT_EQ(landmarks.compliance.points().size(), 2u);
  EXPECT_TRUE(landmarks.compliance.is_empty());
  EXPECT_TRUE(landmarks.is_numbered());
  EXPECT_NE(landmarks.revision().displacements, 0u);
}

TEST(LandmarkSet, DoesNotAllocateWithinWhatWasReserved) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "a sanitizer owns malloc";
  LandmarkSet landmarks;
  landmarks.reserve(8);
  const std::uint64_t before = test::allocation_count();
  for (int tick = 0; tick < 20; ++tick) {
    Needle{.tip_mm = 12 + 0.1 * tick, .core_mm = 8 + 0.1 * (tick % 3), .guide_mm = 110 + tick * 0.5}.tick(
        landmarks);
    if (tick % 5 == 0) {
      landmarks.positions.pop_back();
      landmarks.displacements.pop_back();
      landmarks.remove(4);
      landmarks.number();
      landmarks.settle();
    }
  }
  EXPECT_EQ(test::allocation_count() - before, 0u);
}

}  // namespace
}  // namespace brachy
