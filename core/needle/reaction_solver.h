#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace brachy {

/// Stick and slip of all landmarks at once (core/DESIGN.md, section 5, Karnopp): how far each slips so that
/// no reaction leaves its bounds.
///
/// Stuck everywhere, the axial reactions are φ* (N). Slipping by σ_i along the needle reduces them by H σ, H
/// (N/mm) being the axial stiffness of the landmarks together (TissueField::axial_stiffness; symmetric
/// positive definite):
///
///     φ = φ* − H σ,   low ≤ φ ≤ high,   σ_i > 0 only where φ_i = high_i,   σ_i < 0 only where φ_i = low_i
///
/// the conditions of min ½ fᵀKf − fᵀd* with |f_i| bounded along the axis and free across it. Solved by an
/// active set: block principal pivoting, with single pivots once block pivots make no progress, which ends for every
/// such H (J. Júdice, F. Pires, Comput. Oper. Res. 21 (1994) 587; K. Murty, Opsearch 11 (1974) 129). It
/// starts from the last solution's sets.
/// Threads: one. Real-time: no allocation up to the capacity; work is bounded by WorkBudget::kReactionPivots.
class ReactionSolver {
 public:
  /// Reactions may leave their bounds by this share of the largest finite one or of 1 N, whichever is more; and by
  /// kRounding of the largest stuck reaction, which is what systems of large condition round to.
  static constexpr double kTolerance = 1e-9, kRounding = 1e-12;

  struct Result {
    bool converged = true;
    int pivots = 0;         ///< systems solved
    double residual_n = 0;  ///< how far a reaction is out of its bounds, or off the one that it slips at
  };

  explicit ReactionSolver(std::size_t capacity);

  /// n landmarks; `low` ≤ `high` may be infinite. Writes `slips` (mm) and `reactions` (φ, N).
  Result solve(const Eigen::Ref<const Eigen::MatrixXd>& stiffness, std::span<const double> stuck,
               std::span<const double> low, std::span<const double> high, std::span<double> slips,
               std::span<double> reactions) noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h): the sets, from which reactions have their last bits.
  template <class Archive>
  void list_state(Archive& archive) {
    archive(sides_);
  }

 private:
  enum Side : std::int8_t { kLow = -1, kStuck = 0, kHigh = 1 };

  bool solve_for_sides(std::span<const double> low, std::span<const double> high) noexcept;
  std::size_t find_violations(std::span<const double> low, std::span<const double> high) noexcept;
  void evaluate() noexcept;

  Eigen::MatrixXd stiffness_, factor_;
  Eigen::VectorXd stuck_, slip_, reaction_, solution_;
  std::vector<Side> sides_, wanted_;
  std::vector<Eigen::Index> slipping_;
  Eigen::Index count_ = 0;
  double tolerance_ = 0;
};

}  // namespace brachy
