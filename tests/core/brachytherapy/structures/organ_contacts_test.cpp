#include "core/brachytherapy/structures/organ_contacts.h"

#include <gtest/gtest.h>

#include <array>

#include "core/base/error.h"
#include "core/brachytherapy/structures/organ_pass_file.h"
#include "core/brachytherapy/structures/phantom_structures.h"
#include "tests/core/simulation/allocation_guard.h"

namespace brachy {
namespace {

constexpr double kPeriodS = 0.005, kShaftMm = 200;

/// Closed, outward: half the side `half` about the origin, mm.
SurfaceMesh cube(double half) {
  SurfaceMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(half * Vec3(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

std::vector<TestedOrgan> organs_of(SurfaceMesh mesh) {
  return tested_organs({{"prostate", cube(20)}, {"urethra", std::move(mesh)}});
}

/// A needle along +z outside any tissue.
class FreeNeedle {
 public:
  explicit FreeNeedle(const std::vector<TestedOrgan>& organs) : contacts_(organs) {}

  void step(const Vec3& tip) {
    points_ = {tip - kShaftMm * Vec3::UnitZ(), tip};
    const NeedleCourse course{.points = points_};
    contacts_.update(++tick_, kPeriodS, &course, std::span(&contact, 1));
  }
  void go(const Vec3& from, const Vec3& to, int steps) {
    for (int i = 0; i <= steps; ++i) step(from + (to - from) * (static_cast<double>(i) / steps));
  }
  void remove() { contacts_.update(++tick_, kPeriodS, nullptr, std::span(&contact, 1)); }

  OrganContact contact;

 private:
  OrganContacts contacts_;
  std::array<Vec3, 2> points_;
  std::uint64_t tick_ = 0;
};

TEST(TestedOrgans, AreAllStructuresButTheProstateAndTheArchIsBone) {
  const auto organs = tested_organs({{"prostate", cube(20)}, {"rectum", cube(5)}, {"pubic_arch", cube(5)}});
  EXPECT_EQ(names_of(organs), (std::vector<std::string>{"rectum", "pubic_arch"}));
  EXPECT_FALSE(organs[0].is_bone);
  EXPECT_TRUE(organs[1].is_bone);
}

TEST(OrganContacts, APassHasTheTipsLargestDistanceFromTheSurfaceAndItsTimeInside) {
  const auto organs = organs_of(cube(5));
  FreeNeedle needle(organs);
  needle.go({2, 0, -20}, {2, 0, -5.5}, 20);
  EXPECT_FALSE(needle.contact.is_in);
  needle.go({2, 0, -5.5}, {2, 0, 1}, 65);  // 60 of them inside
  EXPECT_TRUE(needle.contact.is_in);
  EXPECT_NEAR(needle.contact.time_s, 60 * kPeriodS, 2 * kPeriodS);
  needle.go({2, 0, 1}, {2, 0, -20}, 100);
  EXPECT_FALSE(needle.contact.is_in);
  EXPECT_EQ(needle.contact.passes, 1u);
  EXPECT_NEAR(needle.contact.depth_mm, 3, 1e-9);  // x = 5 is the nearest wall
  EXPECT_NEAR(needle.contact.entered_at.z(), -5, 0.2);
}

// Across the tube of 3 mm radius, 1.7 mm a tick, which is 340 mm/s.
TEST(OrganContacts, DepthIsFoundBetweenTheTicksOfAFastNeedle) {
  const auto organs = organs_of(phantom_urethra());
  FreeNeedle needle(organs);
  for (double x = -11; x < 12; x += 1.7) needle.step({x, -4, -3});
  EXPECT_EQ(needle.contact.passes, 1u);
  EXPECT_NEAR(needle.contact.depth_mm, 3, 0.15);
}

TEST(OrganContacts, EachPassCountsOnceAndAJitterAtTheWallDoesNot) {
  const auto organs = organs_of(cube(5));
  FreeNeedle needle(organs);
  for (int pass = 0; pass < 3; ++pass) {
    needle.go({0, 0, -20}, {0, 0, 12}, 160);  // through, and the shaft stays inside
    EXPECT_TRUE(needle.contact.is_in);
    needle.go({0, 0, 12}, {0, 0, -4.9}, 85);
    for (int i = 0; i < 20; ++i) needle.step({0, 0, i % 2 ? -5.4 : -4.8});
    needle.go({0, 0, -5.4}, {0, 0, -20}, 50);
    EXPECT_EQ(needle.contact.passes, static_cast<std::uint32_t>(pass + 1));
  }
}

TEST(OrganContacts, AShaftThatIsMovedSidewiseIntoAnOrganIsInIt) {
  const auto organs = organs_of(cube(5));
  FreeNeedle needle(organs);
  needle.go({12, 0, 40}, {6, 0, 40}, 12);
  EXPECT_FALSE(needle.contact.is_in);
  needle.go({6, 0, 40}, {3, 0, 40}, 12);
  EXPECT_TRUE(needle.contact.is_in);
  EXPECT_NEAR(needle.contact.depth_mm, 2, 1e-9);
  needle.go({3, 0, 40}, {7, 0, 40}, 12);
  EXPECT_FALSE(needle.contact.is_in);
  EXPECT_EQ(needle.contact.passes, 1u);
}

TEST(OrganContacts, ANeedleThatIsTakenAwayEndsItsPass) {
  const auto organs = organs_of(cube(5));
  FreeNeedle needle(organs);
  needle.go({0, 0, -9}, {0, 0, 0}, 40);
  needle.remove();
  EXPECT_FALSE(needle.contact.is_in);
  EXPECT_EQ(needle.contact.passes, 1u);
}

// The tissue is dragged along by 4 mm: in the world the tip is inside, in the tissue it has not come there yet.
TEST(OrganContacts, WithinTissueTheMaterialPointDecides) {
  const auto organs = organs_of(cube(5));
  OrganContacts contacts(organs);
  OrganContact contact;
  CutPath path(400);
  path.start({0, 0, -18});
  const auto tick = [&](double s) {
    path.extend_to({0, 0, -18 + s});
    const Vec3 tip(0, 0, -18 + s + 4);
    const std::array<Vec3, 2> points = {tip - kShaftMm * Vec3::UnitZ(), tip};
    const NeedleCourse course{.points = points, .path = &path, .tip_s = s, .entry = Vec3(0, 0, -18)};
    contacts.update(1, kPeriodS, &course, std::span(&contact, 1));
  };
  for (double s = 0; s < 12.9; s += 0.1) tick(s);
  EXPECT_EQ(contact.passes, 0u);
  for (double s = 12.9; s < 15; s += 0.1) tick(s);
  EXPECT_EQ(contact.passes, 1u);
  EXPECT_NEAR(contact.depth_mm, 2, 0.11);
  // The tip goes back along its cut; the shaft is inside until it is behind where it came in.
  for (double s = 15; s > 11; s -= 0.1) {
    const Vec3 tip(0, 0, -18 + s + 4);
    const std::array<Vec3, 2> points = {tip - kShaftMm * Vec3::UnitZ(), tip};
    const NeedleCourse course{.points = points, .path = &path, .tip_s = s, .entry = Vec3(0, 0, -18)};
    contacts.update(2, kPeriodS, &course, std::span(&contact, 1));
    if (s > 12.2 || s < 11.8) {
      EXPECT_EQ(contact.is_in, s > 12) << s;
    }
  }
}

TEST(OrganContacts, ANeedlePutInAtOnceIsFoundAlongItsPath) {
  const auto organs = organs_of(cube(5));
  OrganContacts contacts(organs);
  OrganContact contact;
  CutPath path(400);
  path.start({1, 0, -18});
  path.extend_to({1, 0, 18});
  const Vec3 tip(1, 0, 18);
  const std::array<Vec3, 2> points = {tip - kShaftMm * Vec3::UnitZ(), tip};
  const NeedleCourse course{.points = points, .path = &path, .tip_s = 36, .entry = Vec3(1, 0, -18)};
  contacts.update(1, kPeriodS, &course, std::span(&contact, 1));
  EXPECT_TRUE(contact.is_in);
}

TEST(OrganContacts, AllocateNothing) {
  if (!test::allocations_are_counted()) GTEST_SKIP() << "the sanitizer owns malloc";
  const auto organs = organs_of(phantom_urethra());
  FreeNeedle needle(organs);
  const std::uint64_t before = test::allocation_count();
  needle.go({0, -4, -40}, {0, -4, 30}, 300);
  EXPECT_EQ(test::allocation_count(), before);
}

TEST(OrganPassFile, ReadsBackWhatItWroteAndAnEndReplacesItsBeginning) {
  OrganContact contact;
  contact.passes = 2;
  contact.entered_tick = 100;
  contact.left_tick = 180;
  contact.depth_mm = 4.25;
  contact.time_s = 0.4;
  contact.entered_at = {1, 2, 3};
  const OrganPass begun = pass_of(contact, "urethra", 1, 0.5, false),
                  ended = pass_of(contact, "urethra", 1, 0.9, true);
  const std::string text = std::string(kOrganPassHeader) + "\n" + organ_pass_row(begun) + "\n";
  ASSERT_EQ(parse_organ_passes(text, "contacts.csv").size(), 1u);
  EXPECT_FALSE(parse_organ_passes(text, "contacts.csv")[0].is_ended);
  const auto passes = parse_organ_passes(text + organ_pass_row(ended) + "\n", "contacts.csv");
  ASSERT_EQ(passes.size(), 1u);
  EXPECT_TRUE(passes[0].is_ended);
  EXPECT_EQ(passes[0].organ, "urethra");
  EXPECT_EQ(passes[0].needle, 1u);
  EXPECT_EQ(passes[0].depth_mm, 4.25);
  EXPECT_EQ(passes[0].entered_at, Vec3(1, 2, 3));
  EXPECT_THROW(parse_organ_passes(text + "urethra,1,nonsense\n", "contacts.csv"), UserError);
}

}  // namespace
}  // namespace brachy
