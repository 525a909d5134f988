#include "core/brachytherapy/plan/change/plan_ledger.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/brachytherapy/plan/change/hole_loading.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/seeds/seed_loading.h"
#include "core/geometry/tissue/phantom.h"
#include "tests/core/simulation/allocation_guard.h"

namespace brachy {
namespace {

constexpr double kNeedleMm = 200;

Plan three_needles() {
  Plan plan;
  plan.base_plane_mm = 80;
  plan.needles = {{"E7", 0, "s-s"}, {"G5", 5, "s"}, {"I9", 0, "ss"}};
  return plan;
}

PlanLedger ledger_of_three() {
  return PlanLedger(three_needles(), TemplateGrid(), kNeedleMm);
}

Seed fallen_seed(std::int32_t planned) {
  Seed seed;
  seed.planned = planned;
  return seed;
}

std::string refusal_of(const PlanLedger& ledger, const std::vector<char>& begun, PlanNeedle needle) {
  Plan rest = three_needles();
  rest.needles = {std::move(needle)};
  try {
    static_cast<void>(ledger.with_rest(begun, rest));
  } catch (const UserError& e) {
    return e.what();
  }
  return {};
}

TEST(PlanLedger, AChangeKeepsNumbersAndAppendsWhatIsNew) {
  PlanLedger ledger = ledger_of_three();
  const std::array fallen = {fallen_seed(0)};  // E7's first
  const std::vector<char> begun = ledger.begun(fallen, {});
  EXPECT_EQ(begun, (std::vector<char>{1, 0, 0}));
  Plan rest = ledger.rest(begun);
  EXPECT_EQ(rest.needles.size(), 2u);
  rest.needles[0].train = "s-s";           // G5's, longer
  rest.needles.push_back({"C6", 2, "s"});  // and I9 as it was
  ledger.change_to(ledger.with_rest(begun, rest));

  EXPECT_EQ(ledger.changes(), 1u);
  ASSERT_EQ(ledger.all().needles.size(), 5u);
  EXPECT_FALSE(ledger.is_withdrawn(0));
  EXPECT_TRUE(ledger.is_withdrawn(1));
  EXPECT_FALSE(ledger.is_withdrawn(2));
  const auto seeds = ledger.all().seeds(TemplateGrid()), before = three_needles().seeds(TemplateGrid());
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(seeds[i].position, before[i].position) << i;
  EXPECT_EQ(ledger.in_use().needles.size(), 4u);
}

TEST(PlanLedger, ADeeperNeedleLeavesTheOthersWhereTheyAre) {
  PlanLedger ledger = ledger_of_three();
  Plan rest = three_needles();
  rest.base_plane_mm = 90;
  rest.needles = {{"C6", 0, "s"}};
  ledger.change_to(ledger.with_rest({1, 0, 0}, rest));
  EXPECT_EQ(ledger.depth_mm(0), 80);
  EXPECT_EQ(ledger.depth_mm(3), 90);
  const Plan in_use = ledger.in_use();
  EXPECT_EQ(in_use.base_plane_mm, 90);
  EXPECT_EQ(in_use.needles[0].retraction_mm, 10);
  EXPECT_EQ(in_use.needles[1].retraction_mm, 0);
}

// As a session's files have them: each change a whole plan.
TEST(PlanLedger, IsTheSameWhenItIsMadeAgainFromTheFilesOfItsChanges) {
  PlanLedger ledger = ledger_of_three(), again = ledger_of_three();
  Plan rest = three_needles();
  rest.needles = {{"C6", 3.3, "s-s"}};
  for (const char* train : {"s", "s-s", "s"}) {
    rest.needles[0].train = train;
    ledger.change_to(ledger.with_rest({1, 0, 0, 0, 0}, rest));
    const std::string file = to_toml(ledger.in_use(), {});
    again.change_to(parse_plan_toml(file, "change", TemplateGrid(), kNeedleMm));
  }
  EXPECT_EQ(ledger.all().needles.size(), 5u);  // the third is the first one again
  EXPECT_EQ(to_toml(again.in_use(), {}), to_toml(ledger.in_use(), {}));
  for (std::size_t n = 0; n < 5; ++n) EXPECT_EQ(again.is_withdrawn(n), ledger.is_withdrawn(n)) << n;
}

TEST(PlanLedger, WhatIsLeftInANeedleThatWasBegunIsAsGoodAsPlaced) {
  const PlanLedger ledger = ledger_of_three();
  const std::array fallen = {fallen_seed(0), fallen_seed(Seed::kUnplanned)};
  const std::array<std::int32_t, 1> lost = {3};  // I9's first: its second is still to come
  EXPECT_EQ(ledger.begun(fallen, lost), (std::vector<char>{1, 0, 1}));
  EXPECT_EQ(ledger.placed(fallen, lost).size(), 4u);  // two that lie, E7's second and I9's
}

TEST(PlanLedger, RefusesWhatCannotBeDoneInAnOperatorsWords) {
  const PlanLedger ledger = ledger_of_three();
  const std::vector<char> begun = {1, 0, 0};
  EXPECT_NE(
      refusal_of(ledger, begun, {"Z9", 0, "s"}).find("hole Z9: its hole is \"Z9\"; the template has A1"),
      std::string::npos);
  EXPECT_NE(refusal_of(ledger, begun, {"E7", 0, "s"}).find("hole E7: a needle went through it"),
            std::string::npos);
  EXPECT_NE(refusal_of(ledger, begun, {"C6", -130, "s"}).find("210 mm beyond the template"),
            std::string::npos);
  EXPECT_NE(refusal_of(ledger, begun, {"C6", 80, "s"}).find("place it deeper"), std::string::npos);
  EXPECT_NE(refusal_of(ledger, begun, {"C6", 0, "x"}).find("its train is \"x\""), std::string::npos);
  EXPECT_NE(refusal_of(ledger, begun, {"C6", 0, "--"}).find("has no seed"), std::string::npos);
  EXPECT_EQ(refusal_of(ledger, begun, {"C6", 0, "s"}), "");
  EXPECT_EQ(refusal_of(ledger, begun, {"G5", 0, "s"}), "");  // not begun: it goes
}

TEST(PlanLedger, EndsChangesBeforeTheSeedsOfAllNeedlesAreMoreThanAreCounted) {
  PlanLedger ledger = ledger_of_three();
  Plan rest = three_needles();
  const auto change = [&](int n) {
    rest.needles = {{"C6", 0.001 * n, "ssssssssssssssss"}};
    ledger.change_to(ledger.with_rest(std::vector<char>(ledger.all().needles.size(), 0), rest));
  };
  int n = 0;
  for (; ledger.all().seed_count() + 16 <= LoadingPlan::kMostSeeds; ++n) change(n);
  EXPECT_THROW(change(n), UserError);
  EXPECT_EQ(ledger.changes(), static_cast<std::size_t>(n));
}

// Seeds keep their numbers through the change; the needle that the plan has no more gives none.
TEST(PlanLedger, ANeedleIsLoadedAsTheChangedPlanHasIt) {
  PlanLedger ledger = ledger_of_three();
  const TemplateGrid grid;
  SeedSettings settings;
  SeedLoading loading(settings, grid, three_needles(), 1);
  NeedlePose pose;
  pose.present = true;
  const auto press = [&](const char* hole) {
    pose.X_WN.p = *grid.position(hole) + Vec3(0, 0, 80);
    pose.button = true;
    loading.update(0, pose);
    const auto due = loading.due(0);
    if (due) loading.dropped(0);
    pose.button = false;
    loading.update(0, pose);
    return due ? due->planned : -2;
  };
  EXPECT_EQ(press("E7"), 0);
  Plan rest = three_needles();
  rest.needles = {{"C6", 0, "s"}};
  ledger.change_to(ledger.with_rest({1, 0, 0}, rest));
  const LoadingPlan changed = ledger.loading();
  const std::uint64_t allocations = test::allocation_count();
  loading.set_plan(changed);
  EXPECT_EQ(test::allocation_count(), allocations);
  EXPECT_EQ(press("C6"), 5);
  EXPECT_EQ(press("E7"), 1);                 // the rest of the one that was begun
  EXPECT_EQ(press("G5"), Seed::kUnplanned);  // a magazine's seed that nobody planned
}

TEST(HoleLoading, LoadsAHoleFromTheFarEndOfItsWayThroughTheGlandToTheNearOne) {
  const std::vector<Structure> structures = {{"prostate", prostate_phantom(400)}};
  const TemplateGrid grid;
  const std::vector<GlandHole> holes = find_gland_holes(structures, grid);
  const HoleLoading middle = load_hole(holes, grid, "G7"), rim = load_hole(holes, grid, "D7");
  EXPECT_EQ(middle.depth_mm, std::floor(middle.depth_mm));
  EXPECT_GT(middle.train.size(), rim.train.size());
  EXPECT_EQ(middle.train.substr(0, 3), "s-s");
  EXPECT_THROW(load_hole(holes, grid, "A1"), UserError);
  EXPECT_THROW(load_hole(holes, grid, "Z9"), UserError);
}

}  // namespace
}  // namespace brachy
