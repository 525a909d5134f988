// What is factorized and evaluated again, and what is not: the base of all deformation models, by landmarks' numbers.
#include "core/models/tissue_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

namespace brachy {
namespace {

/// Every landmark on a spring of its own. It counts what it is asked for.
class CountingField : public TissueField {
 public:
  explicit CountingField(bool knows_all = false)
      : TissueField({.max_landmarks = 8, .uses_spreads = knows_all, .gives_way = knows_all}) {}
  bool is_solvable = true;
  int factorized = 0, new_sets = 0;

  std::span<const std::uint32_t> touched() const override { return {}; }
  const BlockDisplacement<float>& displacement(std::uint32_t) const override { return nowhere_; }
  Vec3 displacement_at(const Vec3&) const noexcept override { return Vec3::Zero(); }
  const CellField& cells() noexcept override { std::abort(); }  // nobody certifies it
  std::size_t max_sources() const override { return 0; }

 private:
  FactorStatus do_factorize(const LandmarkSet&, double&) noexcept override {
    ++factorized;
    return {is_solvable ? FactorStatus::kOk : FactorStatus::kNotPositiveDefinite};
  }
  void do_solve(std::span<const Vec3> displacements, std::span<Vec3> weights) noexcept override {
    std::ranges::copy(displacements, weights.begin());
  }
  void do_project_inverse(std::size_t, std::span<const Vec3>,
                          Eigen::Ref<Eigen::MatrixXd> H) noexcept override {
    H.setIdentity();
  }
  Evaluation do_evaluate(bool is_new_set, std::span<Vec3> weights) noexcept override {
    new_sets += is_new_set;
    do_solve(displacements(), weights);
    return Evaluation::kDirect;
  }
  void do_rescale(double) noexcept override {}

  BlockDisplacement<float> nowhere_{};
};

struct TissueFieldNumbers : ::testing::Test {
  void assign(double z, double pushed, double core = 0, double arc = 0) {
    LandmarkCompliance compliance;
    compliance.add_landmark({.arc_mm = arc});
    landmarks.assign(std::vector<Vec3>{{0, 0, z}}, std::vector<Vec3>{{0, 0, pushed}},
                     std::vector<LandmarkSpread>{{.core_mm = core}}, compliance);
  }
  LandmarkSet landmarks;
};

TEST_F(TissueFieldNumbers, TheSameSetIsFactorizedOnceAndEvaluatedWhereItMoves) {
  CountingField field;
  assign(1, 0.5);
  ASSERT_TRUE(field.update(landmarks));
  assign(1, 0.5);
  ASSERT_TRUE(field.update(landmarks));
  EXPECT_EQ(field.evaluation(), Evaluation::kIdle);
  assign(1, 0.75);
  ASSERT_TRUE(field.update(landmarks));
  EXPECT_EQ(field.evaluation(), Evaluation::kDirect);
  EXPECT_EQ(field.factorized, 1);
  EXPECT_EQ(field.new_sets, 1);
  assign(2, 0.75);
  ASSERT_TRUE(field.update(landmarks));
  EXPECT_EQ(field.factorized, 2);
  EXPECT_EQ(field.new_sets, 2);
  EXPECT_EQ(field.landmark_positions()[0], Vec3(0, 0, 2));
}

TEST_F(TissueFieldNumbers, WhatAModelDoesNotUseIsNoOtherSet) {
  CountingField plain, all(true);
  for (const auto& [core, arc] : {std::pair{0.0, 0.0}, {5.0, 0.0}, {5.0, 30.0}}) {
    assign(1, 0.5, core, arc);
    ASSERT_TRUE(plain.update(landmarks));
    ASSERT_TRUE(all.update(landmarks));
  }
  EXPECT_EQ(plain.factorized, 1);
  EXPECT_EQ(plain.new_sets, 1);
  EXPECT_EQ(plain.evaluation(), Evaluation::kIdle);
  EXPECT_EQ(all.factorized, 3);
  EXPECT_EQ(all.new_sets, 3);
}

TEST_F(TissueFieldNumbers, AFailedFactorizationLeavesNothingFactorizedAndTheFieldAsItWas) {
  CountingField field;
  assign(1, 0.5);
  ASSERT_TRUE(field.update(landmarks));
  field.is_solvable = false;
  const LandmarkSet other = LandmarkSet::of(std::vector<Vec3>{{0, 0, 2}}, std::vector<Vec3>{{0, 0, 3}});
  EXPECT_FALSE(field.update(other));
  EXPECT_FALSE(field.update(other));
  EXPECT_EQ(field.factorized, 3);
  EXPECT_EQ(field.landmark_positions()[0], Vec3(0, 0, 1));
  // The field's own set has to be factorized again, and its field is still there.
  field.is_solvable = true;
  assign(1, 0.5);
  ASSERT_TRUE(field.update(landmarks));
  EXPECT_EQ(field.factorized, 4);
  EXPECT_EQ(field.new_sets, 1);
  EXPECT_EQ(field.evaluation(), Evaluation::kIdle);
}

TEST_F(TissueFieldNumbers, FactorizingAnotherSetLeavesTheFieldToBeEvaluatedAgain) {
  CountingField field;
  assign(1, 0.5);
  ASSERT_TRUE(field.update(landmarks));
  ASSERT_TRUE(field.factorize(LandmarkSet::of(std::vector<Vec3>{{0, 0, 2}})));
  ASSERT_TRUE(field.update(landmarks));
  EXPECT_EQ(field.factorized, 3);
  EXPECT_EQ(field.new_sets, 1);
  EXPECT_EQ(field.evaluation(), Evaluation::kIdle);
}

}  // namespace
}  // namespace brachy
