#include "apps/daemon/telemetry/guard_events.h"

#include <gtest/gtest.h>

#include <vector>

namespace brachy {
namespace {

struct Guarded : ::testing::Test {
  /// The guard's state at `time_s`, reported or not.
  std::optional<std::string> at(double time_s, Verdict verdict, std::uint32_t flags = 0) {
    tick.sim_time_s = time_s;
    tick.certificate.verdict = verdict;
    tick.step_flags = flags;
    return events.update(tick);
  }

  TickSummary tick;
  GuardEvents events;
};

TEST_F(Guarded, EachChangeIsToldOnceInWords) {
  tick.certificate.place = {1.5, -2, 30};
  tick.certificate.substeps = 3;
  tick.certificate.held_mm = 2.14;
  EXPECT_EQ(at(1, Verdict::kInjective), std::nullopt);
  EXPECT_EQ(at(2, Verdict::kInjective, kStepSubstepped), "sub-steps: 3");
  EXPECT_EQ(at(3, Verdict::kInjective, kStepSubstepped), std::nullopt);
  EXPECT_EQ(at(4, Verdict::kInjective, kStepSubstepped | kStepClamped),
            "sub-steps: 3, landmarks clamped 2.1 mm");
  EXPECT_EQ(at(5, Verdict::kFolded, kStepFolded), "field folds at (1.5, -2.0, 30.0) mm");
  EXPECT_EQ(at(6, Verdict::kUnknown, kStepUncertified | kStepDropped),
            "not known whether the field folds, landmarks left out");
  EXPECT_EQ(at(7, Verdict::kInjective, kStepMerged), "injective again, landmarks merged");
  EXPECT_EQ(at(8, Verdict::kInjective), "injective again");
  tick.certificate.held_n = 0.75;
  EXPECT_EQ(at(9, Verdict::kInjective, kStepClamped), "landmarks clamped 2.1 mm (0.75 N)");
  EXPECT_EQ(at(10, Verdict::kInjective, kStepSolveFailed), "landmarks not solved: the last field stands");
  EXPECT_EQ(at(11, Verdict::kInjective, kStepSteep), "a needle bends by more than 8°");
}

TEST_F(Guarded, FlagsThatAreNotTheGuardsAreNoChange) {
  EXPECT_EQ(at(1, Verdict::kInjective, kStepSaturated | kStepReinitialized), std::nullopt);
}

// 10 Hz over a fold for a minute at 30 snapshots a second: events to viewers stay rate-limited.
TEST_F(Guarded, AShakingNeedleDoesNotFloodAndTheLastStateIsTold) {
  std::vector<std::string> told;
  for (int k = 0; k < 1800; ++k) {
    const bool folds = k / 2 % 2 == 0;
    const auto text = folds ? at(k / 30.0, Verdict::kFolded, kStepFolded) : at(k / 30.0, Verdict::kInjective);
    if (text) told.push_back(*text);
  }
  EXPECT_GE(told.size(), 30u);
  EXPECT_LE(told.size(), 64u);
  EXPECT_NE(told.back().find("changes before it not reported)"), std::string::npos) << told.back();
  std::optional<std::string> last;
  for (int k = 0; k < 60; ++k)
    if (auto text = at(60 + k / 30.0, Verdict::kFolded, kStepFolded)) last = text;
  if (!last) last = told.back();
  EXPECT_TRUE(last->starts_with("field folds")) << *last;
}

}  // namespace
}  // namespace brachy
