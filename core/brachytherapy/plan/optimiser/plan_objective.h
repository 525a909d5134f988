#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/brachytherapy/dose/dose_goal.h"
#include "core/brachytherapy/plan/optimiser/plan_points.h"

namespace brachy {

/// A penalty on a structure's dose. A point with dose x (a share of the prescription) is penalised by how far x is
/// beyond `threshold`, but at most `cap`; m is the mean over the structure's points, divided by `cap` where there is
/// one, so that it is the share of the volume beyond, with a soft edge. The term costs
///
///   weight · m + excess · max(0, m − allowed).
///
/// Without a cap this is the penalty of inverse planning by simulated annealing (IPSA: Lessard, Pouliot, Med. Phys. 28,
/// 2001, 773–779), a constant slope for each Gy beyond the limit; with one it is a point of the DVH.
struct PenaltyTerm {
  enum class Side { kBelow, kAbove };
  std::string structure;  ///< "prostate" (the gland, whatever its name), any other's name, or "" for the rest
  Side side;
  double threshold;   ///< where the penalty begins; share of the prescription
  double cap;         ///< 0: none
  double weight;      ///< of all of m
  double excess;      ///< of what exceeds `allowed`
  double allowed;     ///< share of the volume; of one given in cc, see allowed_cc
  double allowed_cc;  ///< > 0: `allowed` is this by the volume that the structure's points stand for
};

/// A plan's objective: penalties, and what each needle and each seed costs. Smaller is better; 0 is unattainable.
struct PlanObjective {
  std::vector<PenaltyTerm> terms;
  double per_needle = 0.004, per_seed = 0.0005;

  /// The goals of core/brachytherapy/plan/optimiser/README.md, which explains every term and weight.
  static PlanObjective standard();
  /// The same, but the gland's coverage begins at 1.12 of the prescription: what a robust plan starts from.
  static PlanObjective with_margin();
  /// What a plan should keep where its seeds fall with clinical noise (PlacementNoise): the gland's coverage.
  static PlanObjective misplaced();
  /// Adds the goals of a plan as constraints: a term each, as strong as the standard ones, whose threshold lies inside
  /// the goal by 0.03 of the prescription, because points are fewer than voxels. Goals of an implant add nothing.
  void add_goals(const std::vector<DoseGoal>& goals);
};

/// A row of doses added to (+1) or taken from (−1) all points.
struct RowChange {
  const float* row;
  float sign;
};

/// An objective made ready for some points: evaluates doses at them, or what they become when rows are added.
/// The inner loops take the processor's widest vectors and give the same bits with any.
/// Threads: const use from any. Real-time: evaluation does not allocate.
class PointObjective {
 public:
  /// `every` > 1: of the first one in so many points of each structure, which are spread as evenly as all of them.
  PointObjective(const PlanObjective& objective, const PlanPoints& points, std::size_t every = 1);

  /// The penalties of the doses (share of the prescription, at all points).
  double of(const float* dose) const { return with(dose, {}, nullptr); }
  /// The penalties of dose + rows, which go to `changed` unless it is null.
  double with(const float* dose, std::span<const RowChange> rows, float* changed) const;

  /// Of one structure: the standard ones, and one of each figure and side. Further goals of the same add nothing.
  static constexpr int kMostTerms = 24;
  struct Term {
    float sign, threshold, cap;  // cap: infinity for none
    double mean_scale, weight, excess, allowed;
  };
  struct Part {
    std::size_t first, count;
    int terms = 0;
    Term term[kMostTerms];
  };

 private:
  std::vector<Part> parts_;
};

}  // namespace brachy
