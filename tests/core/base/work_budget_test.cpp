#include "core/base/work_budget.h"

#include <gtest/gtest.h>

namespace brachy {
namespace {

constexpr WorkBudget kAt200Hz{.period_s = 0.005}, kAt1kHz{.period_s = 0.001};

WorkBudget with_costs(const WorkCosts& costs, double period_s = 0.005) {
  return {.period_s = period_s, .costs = costs};
}

/// Four needles deep in the gland: 22 landmarks, 95 rings in each of four steps, one search done.
constexpr TickWork kFourNeedles{.needles = 4,
                                .landmarks = 22,
                                .steps = 4,
                                .sources = 95,
                                .step_sources = 380,
                                .certificate_pairs = 8000,
                                .blocks = 300};

TEST(WorkBudget, ForcesAndFieldShareATickUpTo900PairsOfLandmarks) {
  for (const WorkBudget& budget : {kAt200Hz, kAt1kHz}) {
    const auto shares = [&](std::size_t changed, std::size_t landmarks) {
      return budget.allowance({.landmarks = landmarks, .changed_landmarks = changed}).may_find_field;
    };
    EXPECT_TRUE(shares(29, 29)) << "29² + 29²/16 = 841 + 52 = 893";
    EXPECT_FALSE(shares(30, 30)) << "900 + 56";
    EXPECT_TRUE(shares(6, 78)) << "6 · 78 + 78²/16 = 468 + 380";
    EXPECT_FALSE(shares(7, 78)) << "546 + 380";
    EXPECT_TRUE(shares(0, 120)) << "14,400 / 16 = 900";
    EXPECT_FALSE(shares(0, 121)) << "14,641 / 16 = 915";
  }
}

TEST(WorkBudget, OfMoreThan24LandmarksForcesAndFieldShareATickUpTo120InAllSteps) {
  for (const WorkBudget& budget : {kAt200Hz, kAt1kHz}) {
    const auto shares = [&](std::size_t landmarks, std::size_t steps) {
      return budget.allowance({.landmarks = landmarks, .steps = steps}).may_find_field;
    };
    EXPECT_TRUE(shares(30, 4)) << "120";
    EXPECT_FALSE(shares(31, 4)) << "124";
    EXPECT_FALSE(shares(25, 5)) << "125";
    EXPECT_TRUE(shares(24, 8)) << "few landmarks";
  }
}

TEST(WorkBudget, NeedlesThatRestComeFirstWhereMoreThanThreeAreInTheTissue) {
  EXPECT_FALSE(kAt200Hz.allowance({.needles = 3}).puts_resting_needles_first);
  EXPECT_TRUE(kAt200Hz.allowance({.needles = 4}).puts_resting_needles_first);
}

TEST(WorkBudget, MoreRingsGoTheirWayInFewerStepsAndAreClampedInTheEnd) {
  for (const WorkBudget& budget : {kAt200Hz, kAt1kHz}) {
    EXPECT_EQ(budget.allowance({.sources = 0}).steps, 400u);
    EXPECT_EQ(budget.allowance({.sources = 95}).steps, 4u) << "400 / 95";
    EXPECT_EQ(budget.allowance({.sources = 201}).steps, 1u);
    EXPECT_EQ(budget.allowance({.sources = 500}).steps, 1u) << "one in any case";
    EXPECT_TRUE(budget.allowance({.steps = 4, .sources = 375}).may_add_step) << "1,500";
    EXPECT_FALSE(budget.allowance({.steps = 4, .sources = 376}).may_add_step);
  }
}

TEST(WorkBudget, CorrectionsGetCoarserWithRingsAndLandmarks) {
  EXPECT_TRUE(kAt200Hz.allowance({.sources = 250}).may_correct_steps);
  EXPECT_FALSE(kAt200Hz.allowance({.sources = 251}).may_correct_steps);
  const Allowance few = kAt200Hz.allowance({.landmarks = 40}), many = kAt200Hz.allowance({.landmarks = 41});
  EXPECT_EQ(few.correction_reach, 10);
  EXPECT_EQ(many.correction_reach, 7);
  EXPECT_TRUE(few.may_renew_corrections);
  EXPECT_FALSE(many.may_renew_corrections);
  EXPECT_EQ(many.correction_sweeps, 16u);
}

TEST(WorkBudget, ACertificateTakesWhatItsTickHasLeft) {
  for (const WorkBudget& budget : {kAt200Hz, kAt1kHz}) {
    const auto after = [&](std::uint64_t spent) { return budget.allowance({.certificate_pairs = spent}); };
    EXPECT_EQ(after(0).certificate_pairs, 8000u);
    EXPECT_EQ(after(24'000).certificate_pairs, 8000u);
    EXPECT_EQ(after(30'000).certificate_pairs, 2000u) << "of 32,000 in a tick";
    EXPECT_EQ(after(40'000).certificate_pairs, 0u) << "a search may go past its end";
    EXPECT_EQ(after(30'000).margin_pairs, 1000u);
    EXPECT_EQ(after(31'500).margin_pairs, 500u);
    EXPECT_EQ(after(0).step_tries, 2u);
  }
}

TEST(WorkBudget, WhatCannotBeCertifiedIsOnlySearchedForFolds) {
  const Allowance undecided = kAt200Hz.allowance({.is_undecided = true});
  EXPECT_FALSE(undecided.may_certify);
  EXPECT_EQ(undecided.certificate_pairs, 1000u);
  EXPECT_TRUE(kAt200Hz.allowance({.sources = 140, .reaches_everywhere = true}).may_certify);
  EXPECT_FALSE(kAt200Hz.allowance({.sources = 141, .reaches_everywhere = true}).may_certify);
  EXPECT_TRUE(kAt200Hz.allowance({.sources = 141}).may_certify) << "sources that reach a few cells each";
}

TEST(WorkBudget, FoldsAreLookedForAtADozenRingsOrAtTheStrongest) {
  EXPECT_EQ(kAt200Hz.allowance({.sources = 11}).candidate_stride, 1u);
  EXPECT_EQ(kAt200Hz.allowance({.sources = 155}).candidate_stride, 13u) << "1 + 155 / 12";
  EXPECT_EQ(kAt200Hz.allowance({.sources = 155}).strongest_candidates, 0u);
  EXPECT_TRUE(kAt200Hz.allowance({.sources = 155}).may_sum_single_rings);
  EXPECT_EQ(kAt200Hz.allowance({.sources = 156}).strongest_candidates, 8u);
  EXPECT_FALSE(kAt200Hz.allowance({.sources = 156}).may_sum_single_rings);
}

TEST(WorkBudget, TheMoreStepsAndRingsTheFewerDeterminantsAreAsked) {
  const auto of = [](std::size_t steps, std::size_t rings) {
    return kAt200Hz.allowance({.steps = steps, .sources = rings});
  };
  EXPECT_EQ(of(1, 99).close_stride, 1u);
  EXPECT_EQ(of(4, 95).close_stride, 4u) << "1 + 380 / 100";
  EXPECT_EQ(of(1, 0).refined_blocks, 6u);
  EXPECT_EQ(of(4, 95).refined_blocks, 3u) << "1,200 / 380";
  EXPECT_EQ(of(4, 400).refined_blocks, 1u) << "one in any case";
  EXPECT_EQ(of(4, 250).weakest_steps, 4u) << "1,000";
  EXPECT_EQ(of(4, 251).weakest_steps, 1u);
}

TEST(WorkBudget, BlocksHaveWhatTheRestOfTheTickLeavesOfItsShareOfThePeriod) {
  // 0.43 · 5 ms − 0.15 − 22 · 0.0245 − 22² · 0.00025 − 8,000 · 2.5e-5 ms = 1.14 ms; 5.2e7 · 1.14e-3 = 59,280 rings;
  // a block takes 10 · (1 + 4) + 380 of them.
  EXPECT_EQ(kAt200Hz.allowance(kFourNeedles).blocks, 137u) << "59,280 / 430";
  TickWork six_steps = kFourNeedles;
  six_steps.steps = 6;
  six_steps.step_sources = 570;
  EXPECT_EQ(kAt200Hz.allowance(six_steps).blocks, 68u) << "5.2e7 · (1.14e-3 − 2 · 1.5e-4) / (10 · 7 + 570)";
  TickWork searched = kFourNeedles;
  searched.certificate_pairs = 100'000;
  EXPECT_EQ(kAt200Hz.allowance(searched).blocks, 65u) << "32,000 pairs count: 5.2e7 · 0.54e-3 / 430";
}

TEST(WorkBudget, AtOneKilohertzTheShareIsOfOneMillisecond) {
  EXPECT_EQ(kAt1kHz.allowance(kFourNeedles).blocks, 25u) << "nothing is left: 300 / 12 in any case";
  // 0.43 − 0.15 − 5 · 0.0245 − 25 · 0.00025 ms = 0.15125 ms; 5.2e7 · 0.15125e-3 = 7,865 rings.
  const TickWork one_needle{.landmarks = 5, .steps = 1, .sources = 20, .step_sources = 20, .blocks = 300};
  EXPECT_EQ(kAt1kHz.allowance(one_needle).blocks, 196u) << "7,865 / (10 · 2 + 20)";
}

TEST(WorkBudget, TheFarFieldGivesWayFirst) {
  TickWork heavy = kFourNeedles;
  heavy.landmarks = 29;  // forces and field still share a tick
  heavy.sources = 140;   // which is certified
  heavy.steps = 2;
  heavy.step_sources = 280;
  heavy.reaches_everywhere = true;
  const Allowance may = kAt200Hz.allowance(heavy);
  EXPECT_LT(may.blocks, heavy.blocks);
  EXPECT_TRUE(may.may_certify);
  EXPECT_EQ(may.certificate_pairs, 8000u);
  EXPECT_TRUE(may.may_add_step);
  EXPECT_TRUE(may.may_find_field);

  heavy.sources = 141;  // then the certificate
  EXPECT_FALSE(kAt200Hz.allowance(heavy).may_certify);
  EXPECT_TRUE(kAt200Hz.allowance(heavy).may_correct_steps);
  heavy.sources = 251;  // then the field near the needles
  EXPECT_FALSE(kAt200Hz.allowance(heavy).may_correct_steps);
  EXPECT_TRUE(kAt200Hz.allowance(heavy).may_find_field);
  heavy.changed_landmarks = heavy.landmarks = 30;  // and forces wait for no field any more
  EXPECT_FALSE(kAt200Hz.allowance(heavy).may_find_field);
}

TEST(WorkBudget, CostsTwiceAsHighHalveWhatMayBeDone) {
  const WorkBudget slow = with_costs(WorkCosts{}.slower_by(2));
  EXPECT_EQ(slow.allowance({}).certificate_pairs, 4000u);
  EXPECT_EQ(slow.allowance({}).margin_pairs, 500u);
  EXPECT_EQ(slow.allowance({.certificate_pairs = 15'000}).certificate_pairs, 1000u) << "16,000 in a tick";
  EXPECT_EQ(slow.allowance({.is_undecided = true}).certificate_pairs, 500u);
  EXPECT_FALSE(slow.allowance({.sources = 71, .reaches_everywhere = true}).may_certify);
  EXPECT_EQ(slow.allowance({.sources = 95}).steps, 2u) << "200 / 95";
  EXPECT_FALSE(slow.allowance({.steps = 2, .sources = 376}).may_add_step);
  EXPECT_FALSE(slow.allowance({.sources = 126}).may_correct_steps);
  EXPECT_FALSE(slow.allowance({.landmarks = 21, .changed_landmarks = 21}).may_find_field) << "441 + 27 > 450";
  EXPECT_FALSE(slow.allowance({.landmarks = 31, .steps = 2}).may_find_field) << "62 > 60";
  // What decides whether folds are seen, or which method is used, stays.
  EXPECT_EQ(slow.allowance({.sources = 155}).candidate_stride, 13u);
  EXPECT_EQ(slow.allowance({.landmarks = 40}).correction_reach, 10);
  EXPECT_FALSE(slow.allowance({.needles = 3}).puts_resting_needles_first);
}

TEST(WorkBudget, BlocksTwiceAsDearAreHalfAsManyAndAPeriodTwiceAsLongMakesUpForAllCosts) {
  WorkCosts costs;
  costs.block_ring_steps_per_s = 2.6e7;
  EXPECT_EQ(with_costs(costs).allowance(kFourNeedles).blocks, 68u) << "29,640 / 430, half of 137";
  EXPECT_EQ(with_costs(WorkCosts{}.slower_by(2), 0.01).allowance(kFourNeedles).blocks, 137u);
}

TEST(WorkBudget, ABlockThatHasWaitedTwelveTicksComesFirst) {
  EXPECT_GT(kAt200Hz.block_priority(1, 0.5F), kAt200Hz.block_priority(3, 0.1F)) << "0.55 and 0.45";
  EXPECT_GT(kAt200Hz.block_priority(11, 0), kAt200Hz.block_priority(1, 0.4F)) << "0.55 and 0.45";
  EXPECT_GT(kAt200Hz.block_priority(12, 0), kAt200Hz.block_priority(11, 100)) << "12,000 and 1,101";
}

}  // namespace
}  // namespace brachy
