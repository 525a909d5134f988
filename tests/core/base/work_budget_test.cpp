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

TEST(WorkBudget, ForcesAndFieldShareATickWhereBothFitIntoItsShare) {
  const auto shares = [](const WorkBudget& budget, std::size_t landmarks, std::size_t steps) {
    return budget.allowance({.landmarks = landmarks, .steps = steps}).may_find_field;
  };
  EXPECT_TRUE(shares(kAt200Hz, 64, 4)) << "sixteen needles";
  EXPECT_TRUE(shares(kAt200Hz, 112, 4)) << "0.2 + 112 · 0.004 + 112² · 0.00015 + 4 · 0.11 = 2.97 of 3 ms";
  EXPECT_FALSE(shares(kAt200Hz, 114, 4)) << "3.05 ms";
  EXPECT_TRUE(shares(kAt1kHz, 25, 1)) << "0.50 of 0.6 ms";
  EXPECT_FALSE(shares(kAt1kHz, 25, 2)) << "0.61 ms";
  EXPECT_TRUE(shares(kAt1kHz, 24, 8)) << "few landmarks";
}

TEST(WorkBudget, WholeTicksDoAllOfTheirFieldWhateverItTakes) {
  WorkBudget whole = kAt1kHz;
  whole.is_whole = true;
  const Allowance may = whole.allowance({.landmarks = 500, .steps = 8, .step_sources = 4000, .blocks = 300});
  EXPECT_TRUE(may.may_find_field);
  EXPECT_EQ(may.easy_blocks, 300u);
  EXPECT_GE(may.blocks, 300u);
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

TEST(WorkBudget, BlocksHaveWhatTheRestOfTheTickLeavesOfItsSharesOfThePeriod) {
  // 0.6 · 5 ms − 0.2 − 22 · 0.004 − 22² · 0.00015 − 4 · 0.11 − 8,000 · 2.5e-5 ms = 1.9994 ms; 5.2e7 · that = 103,969
  // rings; a block takes 40 + 10 · 4 + 380 of them; what lags is found in the time of 300 / 32 of them.
  EXPECT_EQ(kAt200Hz.allowance(kFourNeedles).blocks, 217u) << "103,969 / 460 − 9";
  EXPECT_EQ(kAt200Hz.allowance(kFourNeedles).easy_blocks, 56u) << "5.2e7 · (1.5 − 1.0006) ms / 460";
  TickWork six_steps = kFourNeedles;
  six_steps.steps = 6;
  six_steps.step_sources = 570;
  EXPECT_EQ(kAt200Hz.allowance(six_steps).blocks, 129u) << "5.2e7 · 1.7794 ms / (40 + 60 + 570) − 9";
  TickWork searched = kFourNeedles;
  searched.certificate_pairs = 100'000;
  EXPECT_EQ(kAt200Hz.allowance(searched).blocks, 149u) << "32,000 pairs count: 5.2e7 · 1.3994 ms / 460 − 9";
}

TEST(WorkBudget, AtOneKilohertzTheSharesAreOfOneMillisecond) {
  EXPECT_EQ(kAt1kHz.allowance(kFourNeedles).blocks, 25u) << "nothing is left: 300 / 12 in any case";
  // 0.6 − 0.2 − 5 · 0.004 − 25 · 0.00015 − 0.11 ms = 0.26625 ms; 5.2e7 · that = 13,845 rings.
  const TickWork one_needle{.landmarks = 5, .steps = 1, .sources = 20, .step_sources = 20, .blocks = 300};
  EXPECT_EQ(kAt1kHz.allowance(one_needle).blocks, 188u) << "13,845 / (40 + 10 + 20) − 9";
}

TEST(WorkBudget, TheCertificateGivesWayToBlocksThatAreWanted) {
  // 0.7 · 5 ms less 1.0006 is 2.4994 ms, and a block takes 460 / 5.2e7 s.
  TickWork work = kFourNeedles;
  work.blocks = 200;
  EXPECT_EQ(kAt200Hz.allowance(work).certificate_pairs, 8000u) << "2.4994 − 1.7692 ms are 29,206 pairs";
  EXPECT_EQ(kAt200Hz.allowance(work).step_tries, 2u);
  work.blocks = 262;
  EXPECT_EQ(kAt200Hz.allowance(work).certificate_pairs, 7268u) << "2.4994 − 2.3177 ms";
  EXPECT_EQ(kAt200Hz.allowance(work).step_tries, 1u) << "a shorter step makes another one";
  work.blocks = 300;
  EXPECT_EQ(kAt200Hz.allowance(work).certificate_pairs, 1000u) << "for folds, in any case";
  work.blocks = 0;
  EXPECT_EQ(kAt200Hz.allowance(work).certificate_pairs, 8000u)
      << "of a field that evaluates all of them anyway";
}

TEST(WorkBudget, WhatLagsIsEvaluatedInMoreThanItsShareIfNothingIsLateThen) {
  EXPECT_EQ(kAt200Hz.allowance(kFourNeedles).whole_blocks, 273u) << "5.2e7 · 2.4994 ms / 460 − 9";
}

TEST(WorkBudget, AtRestCertificatesHaveMostOfThePeriod) {
  // 0.75 · 5 ms − 0.2 − 22 · 0.004 − 22² · 0.00015 = 3.3894 ms
  EXPECT_EQ(kAt200Hz.allowance({.landmarks = 22}).resting_pairs, 135'576u);
}

TEST(WorkBudget, TheFarFieldAndTheCertificateGiveWayFirst) {
  TickWork heavy = kFourNeedles;
  heavy.landmarks = 29;
  heavy.sources = 140;  // which is certified
  heavy.steps = 6;
  heavy.step_sources = 840;
  heavy.reaches_everywhere = true;
  const Allowance may = kAt200Hz.allowance(heavy);
  EXPECT_LT(may.blocks, heavy.blocks);
  EXPECT_TRUE(may.may_certify);
  EXPECT_EQ(may.certificate_pairs, 1000u) << "blocks lag";
  EXPECT_TRUE(may.may_add_step);
  EXPECT_TRUE(may.may_find_field);

  heavy.sources = 141;  // then the certificate
  EXPECT_FALSE(kAt200Hz.allowance(heavy).may_certify);
  EXPECT_TRUE(kAt200Hz.allowance(heavy).may_correct_steps);
  heavy.sources = 251;  // then the field near the needles
  EXPECT_FALSE(kAt200Hz.allowance(heavy).may_correct_steps);
  EXPECT_TRUE(kAt200Hz.allowance(heavy).may_find_field);
  heavy.landmarks = 130;  // and forces wait for no field any more
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
  EXPECT_TRUE(slow.allowance({.landmarks = 80}).may_find_field) << "0.4 + 0.64 + 1.92 = 2.96 of 3 ms";
  EXPECT_FALSE(slow.allowance({.landmarks = 90}).may_find_field) << "3.55 ms";
  // What decides whether folds are seen, or which method is used, stays.
  EXPECT_EQ(slow.allowance({.sources = 155}).candidate_stride, 13u);
  EXPECT_EQ(slow.allowance({.landmarks = 40}).correction_reach, 10);
  EXPECT_FALSE(slow.allowance({.needles = 3}).puts_resting_needles_first);
}

TEST(WorkBudget, BlocksTwiceAsDearAreHalfAsManyAndAPeriodTwiceAsLongMakesUpForAllCosts) {
  WorkCosts costs;
  costs.block_ring_steps_per_s = 2.6e7;
  EXPECT_EQ(with_costs(costs).allowance(kFourNeedles).blocks, 104u) << "51,984 / 460 − 9";
  EXPECT_EQ(with_costs(WorkCosts{}.slower_by(2), 0.01).allowance(kFourNeedles).blocks, 217u);
}

}  // namespace
}  // namespace brachy
