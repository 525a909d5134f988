#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/brachytherapy/plan/optimiser/plan_dose.h"

namespace brachy {

/// How far from their plan seeds come to lie, each by itself: SD left–right, antero-posterior and along the needle.
/// 1,197 seeds of clinical implants were off by 1.3, 1.5 and 3.8 mm (core/DESIGN.md, section 6).
struct PlacementNoise {
  std::uint64_t seed = 1;
  Vec3 sd_mm{1.3, 1.5, 3.8};
  double along_mm = 0;          ///< mean along the needle: what all seeds are off by
  double strength_percent = 0;  ///< SD of the dose of all seeds together
  std::size_t draws = 16;       ///< whose mean stands for the expectation
};

/// A plan's penalties where it is followed exactly, plus the mean of other ones over draws of the noise. The draws are
/// common to all plans that are compared: in each, the nth seed of a hole's needle is off by the same vector whatever
/// the plan, so that differences between plans are those of the plans. Doses of misplaced seeds come from a table over
/// the distance from the seed's axis and along it, at steps of 0.25 mm (nearest).
/// Deterministic, the same bits on every machine.
class MisplacedDose final : public PlanDose {
 public:
  /// `planned` and all references outlive this. `points`: for the draws; fewer than for the plan will do.
  MisplacedDose(PlanDose& planned, const std::vector<NeedleChoice>& choices, const PlanPoints& points,
                const PointObjective& objective, SourceModel source, double strength_u,
                double prescription_gy, const PlacementNoise& noise, double weight = 1,
                std::vector<float> placed = {});

  double reset(std::span<const NeedleLoad> loads) override;
  double with(std::span<const LoadChange> changes) override;
  void keep() override;

 private:
  void add_seed(std::size_t draw, std::size_t choice, int ordinal, int row, float sign, float* dose) const;
  const Vec3& offset(std::size_t draw, std::size_t choice, int ordinal) const {
    return offsets_[(draw * choices_.size() + choice) * NeedleLoad::kMostElements +
                    static_cast<std::size_t>(ordinal)];
  }

  PlanDose& planned_;
  const std::vector<NeedleChoice>& choices_;
  const PointObjective& objective_;
  double weight_;
  std::size_t draws_;
  std::vector<float> x_, y_, z_;  // of the points
  std::vector<float> table_;      // by distance from the axis, then along it
  std::vector<Vec3> offsets_;
  std::vector<float> strengths_;  // of each draw, 1 as planned
  std::vector<float> placed_;
  std::vector<std::vector<float>> dose_, changed_;  // of each draw
};

}  // namespace brachy
