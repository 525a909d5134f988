#pragma once

#include <cstdint>
#include <vector>

#include "core/injectivity/cell_field.h"
#include "core/injectivity/certificate.h"

namespace brachy {

/// Where det(I + s ∇u) was found 0 at the least s.
struct FoldCandidate {
  static constexpr double kMaxScale = 8;  ///< none below

  double scale = kMaxScale;  ///< s
  Vec3 place = Vec3::Zero();
};

/// Whether x = X + s u(X) is injective: branch and bound over cells of the continuum. A cell is bounded, cheaply at
/// first, and split into eighths where the bound does not suffice.
///
/// A cell is decided when a bound from norms of ∇u is above the required one, or a bound from ∇u at a lattice of 27
/// points: ∇u is trilinear between lattice points up to h²/8 Σ_k |∂_k²∇u|, h their spacing. A point with det
/// ≤ 0 ends the search. Where u is 0 outside of a bounded set, det > 0 everywhere makes x a bijection (Hadamard).
/// Work is counted in pairs of a lattice and a source, about 15 ns each (AVX-512), not timed. A search may stop
/// anywhere and go on later; what it finds depends on the sum of its work alone.
/// Threads: one. Real-time: no allocation after construction.
class InjectivitySearch {
 public:
  struct Result {
    Verdict verdict = Verdict::kUnknown;
    double det_bound = 1;       ///< over the continuum; meaningless unless injective
    double least_det = 1;       ///< of all points evaluated
    Vec3 place = Vec3::Zero();  ///< of that
    std::uint64_t work = 0;     ///< done
  };

  explicit InjectivitySearch(std::size_t max_sources);

  /// Lower bound of det(I + s ∇u) by norms alone; −1 where they give none.
  static double bound_by_norms(const CellBounds& bounds, double scale) noexcept;

  /// Evaluates the points where a fold is likely, a few for each source; the field may fold a little before.
  FoldCandidate find_fold_candidate(const CellField& field) noexcept;

  /// Begins to search for det(I + `scale` ∇u) ≤ 0, at the candidate first. `field` must stay as it is while the
  /// search goes on. During the first `refining` pairs low bounds are made tighter (WorkBudget::kRefinedBoundShare).
  void begin(const CellField& field, double scale, const FoldCandidate& fold_candidate,
             std::uint64_t refining) noexcept;
  /// Goes on with `work` pairs more; the last cell may take it past them.
  const Result& go_on(std::uint64_t work) noexcept;
  /// Whether more work may decide it.
  bool is_open() const { return result_.verdict == Verdict::kUnknown && !is_too_deep_ && !stack_.empty(); }
  const Result& result() const { return result_; }
  /// Both at once.
  const Result& run(const CellField& field, double scale, const FoldCandidate& fold_candidate,
                    std::uint64_t work) noexcept;

 private:
  struct Node {
    Cell cell;
    std::uint32_t depth = 0;
    double bound = -1;  // of the determinant, known from above
  };
  bool settle(const Node& node, std::size_t count, CellBounds& bounds) noexcept;
  void push_eighths(const Node& node, const float* lower) noexcept;
  double wanted() const noexcept;
  void look_at(const Vec3& X) noexcept;
  void look_at_points(const Cell& cell, const CellGradients& A) noexcept;

  static constexpr std::uint32_t kMaxDepth = 24;
  std::size_t max_sources_;
  std::vector<Node> stack_;
  std::vector<std::uint32_t> candidates_;  // by depth: sources that reach the parents of the current cell
  std::vector<std::size_t> counts_;

  // of the search that was begun
  const CellField* field_ = nullptr;
  double scale_ = 1;
  std::uint64_t refining_ = 0, limit_ = 0;
  bool is_too_deep_ = false;  // a cell as small as they may be was not decided
  Result result_;
};

}  // namespace brachy
