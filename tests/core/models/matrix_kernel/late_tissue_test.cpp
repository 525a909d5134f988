// Sixteen needles: more than a tick has time for, so that some blocks of the tissue come later (kStepLate).
#include <gtest/gtest.h>

#include "core/models/guard/guarded_field.h"
#include "core/models/matrix_kernel/matrix_composition.h"
#include "core/models/step_flag.h"
#include "core/scene/load_tissue.h"
#include "tests/core/simulation/allocation_guard.h"

namespace brachy {
namespace {

constexpr std::size_t kShaftLandmarks = 64;
constexpr int kMostTicks = 20;  // until all of it has come

const Tissue& default_phantom() {
  static const Tissue tissue = load_tissue(Scene{}).tissue;
  return tissue;
}

/// Of a machine that many times as slow as the stored costs.
std::unique_ptr<GuardedField> composed(double slower = 2, bool is_whole = false) {
  const WorkBudget budget{.costs = WorkCosts{}.slower_by(slower), .is_whole = is_whole};
  auto field = std::make_unique<MatrixKernelField>(
      default_phantom(), "elastic", ElasticBody{},
      MatrixKernelField::Options{.max_landmarks = kShaftLandmarks, .evaluates_points = false});
  auto composition = std::make_unique<MatrixComposition>(default_phantom(), *field, best_simd_target(),
                                                         kShaftLandmarks, std::size_t{8}, budget);
  return std::make_unique<GuardedField>(default_phantom(), std::move(field), std::move(composition),
                                        GuardSettings{}, budget);
}

// Shafts of four landmarks each, 8 mm apart, moved by d.
LandmarkSet sixteen(const Vec3& d) {
  std::vector<Vec3> positions, displacements;
  for (int n = 0; n < 16; ++n)
    for (int k = 0; k < 4; ++k) {
      positions.emplace_back(8 * (n % 4) - 12, 8 * (n / 4) - 12, 6 * k - 14);
      displacements.push_back(n % 2 ? d : Vec3(-0.5 * d));
    }
  return LandmarkSet::of(positions, displacements);
}

bool is_late(const GuardedField& field) {
  return (field.flags() & kStepLate) != 0;
}

// Ticks with the same landmarks until nothing is late.
int stand_still(GuardedField& field, const LandmarkSet& push) {
  int ticks = 0;
  while (is_late(field) && ticks < kMostTicks) {
    EXPECT_TRUE(field.update(push));
    EXPECT_NE(field.evaluation(), Evaluation::kIdle);
    if (field.certificate().vertex_det <= 0) {
      EXPECT_EQ(field.certificate().verdict, Verdict::kFolded);
    }
    ++ticks;
  }
  return ticks;
}

Vec3 first_of(const GuardedField& field, std::uint32_t b) {
  const BlockDisplacement<float>& u = field.displacement(b);
  return Vec3(u.ux[0], u.uy[0], u.uz[0]);
}

std::size_t blocks_that_differ(const GuardedField& a, const GuardedField& b) {
  std::size_t count = 0;
  for (std::uint32_t block = 0; block < default_phantom().blocks.size(); ++block)
    count += first_of(a, block) != first_of(b, block);
  return count;
}

TEST(LateTissue, ComesWhileNothingMovesAndIsThenWhatAnyTickShows) {
  const auto moved = composed(), fresh = composed();
  const LandmarkSet before = sixteen({1, 1, 2}), push = sixteen({2, 0, 1});
  ASSERT_TRUE(moved->update(before));
  const std::uint64_t allocated = test::allocation_count();
  ASSERT_TRUE(moved->update(push));
  EXPECT_EQ(test::allocation_count(), allocated);
  ASSERT_TRUE(fresh->update(push));
  ASSERT_TRUE(is_late(*moved));
  ASSERT_TRUE(is_late(*fresh));
  EXPECT_GT(blocks_that_differ(*moved, *fresh), 0u);

  EXPECT_LT(stand_still(*moved, push), kMostTicks);
  EXPECT_LT(stand_still(*fresh, push), kMostTicks);
  EXPECT_EQ(blocks_that_differ(*moved, *fresh), 0u);
  ASSERT_TRUE(moved->update(push));
  EXPECT_EQ(moved->evaluation(), Evaluation::kIdle);
}

TEST(LateTissue, LandmarksAreWhereTheyBelongInEveryTick) {
  const auto field = composed();
  for (const Vec3& d : {Vec3(1, 1, 2), Vec3(2, 0, 1), Vec3(0, -1.5, 2)}) {
    const LandmarkSet push = sixteen(d);
    ASSERT_TRUE(field->update(push));
    for (std::size_t i = 0; i < push.positions.size(); ++i)
      EXPECT_LT((field->displacement_at(push.positions[i]) - push.displacements[i]).norm(), 0.02) << i;
  }
}

// What is left out moves little, of motions that take it by up to 2 mm in all, and by about as much as is told.
TEST(LateTissue, LagsLittleAndSaysByHowMuch) {
  const auto field = composed(1.2), whole = composed(1.2, true);
  double total = 0, told = 0;
  for (int tick = 0; tick < 40; ++tick) {
    const LandmarkSet push = sixteen(Vec3(1 + 0.05 * tick, 0.5, 2 - 0.02 * tick));
    ASSERT_TRUE(field->update(push));
    ASSERT_TRUE(whole->update(push));
    EXPECT_FALSE(is_late(*whole));
    EXPECT_EQ(whole->lag_mm(), 0);
    EXPECT_EQ(is_late(*field), field->lag_mm() > WorkBudget{}.lag_mm);
    if (tick < 10) continue;  // until all of the first push has come
    double lag = 0;
    for (std::uint32_t b = 0; b < default_phantom().blocks.size(); ++b)
      for (std::size_t i = 0; i < default_phantom().blocks[b].count; ++i)
        lag = std::max(
            lag,
            (displacement_in(field->displacement(b), i) - displacement_in(whole->displacement(b), i)).norm());
    EXPECT_LE(lag, 0.4) << tick;
    total += lag;
    told += field->lag_mm();
  }
  EXPECT_GT(total, 0);
  EXPECT_GT(told, 0.3 * total);
}

TEST(LateTissue, IsAtRestOnceNoLandmarkIsLeft) {
  const auto field = composed();
  const LandmarkSet push = sixteen({1, 1, 2});
  ASSERT_TRUE(field->update(push));
  stand_still(*field, push);
  ASSERT_TRUE(field->update(LandmarkSet::of({})));
  EXPECT_TRUE(field->touched().empty());
  // What the next contact has no time for is at rest, not where the last one left it.
  const auto fresh = composed();
  ASSERT_TRUE(field->update(push));
  ASSERT_TRUE(fresh->update(push));
  ASSERT_TRUE(is_late(*field));
  EXPECT_EQ(blocks_that_differ(*field, *fresh), 0u);
}

}  // namespace
}  // namespace brachy
