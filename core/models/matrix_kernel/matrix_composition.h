#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/work_budget.h"
#include "core/models/composition.h"
#include "core/models/matrix_kernel/matrix_kernel_cells.h"
#include "core/models/matrix_kernel/matrix_kernel_field.h"
#include "core/models/matrix_kernel/smooth_cells.h"

namespace brachy {

/// Sub-steps of a matrix-valued kernel, in three parts (core/DESIGN.md, section 3):
///   1. what boundary and regions add, all of it: X ↦ X + R(X);
///   2. steps of the needle's own field, the forces of the landmarks' system on rings that are carried along, and a
///      local correction that makes each step displace the landmarks' tissue as it should;
///   3. such a correction once more, of what is left.
/// Threads: one caller (OpenMP over blocks if the field's options ask). Real-time: as Composition, with one thread.
class MatrixComposition : public Composition {
 public:
  /// Composes the field that `field` was evaluated to last. Tissue and field must outlive this. `budget`: how many
  /// steps, corrections and blocks a tick may take.
  MatrixComposition(const Tissue& tissue, const MatrixKernelField& field, SimdTarget target,
                    std::size_t max_landmarks, std::size_t max_steps, const WorkBudget& budget = {});

  bool is_always_used() const override { return true; }
  double reach() const override { return correction_.is_on ? kCorrectionReach : kReach; }
  double begin(std::span<const Vec3> positions, std::span<const Vec3> displacements) noexcept override;
  const CellField* cells_of_beginning() const override { return smooth_cells_ ? &*smooth_cells_ : nullptr; }
  bool next() noexcept override;
  const CellField& cells() const override { return cells_[count_]; }
  std::size_t kept_fields() const override { return cells_.size(); }
  bool is_like_last() const override { return steps() > 0 && !correction_.is_on; }
  double rest() const override { return correction_.is_on ? 1 : 1 - reached(); }
  void accept(double scale, const Vec3* weakest) noexcept override;
  double missed_mm() const override { return missed_; }
  std::size_t most_steps() const override;

  void evaluate(std::uint64_t work) noexcept override;
  bool is_unfinished() const override { return blocks_.is_unfinished; }
  double lag_mm() const override { return blocks_.lag_mm; }
  bool is_late() const override { return blocks_.lag_mm > budget_.lag_mm; }
  std::size_t wanted_blocks() const override { return blocks_.wanted; }
  void expect_blocks(std::size_t wanted) override { blocks_.wanted = wanted; }
  TickWork work_ahead(std::size_t steps) const override;
  void end() noexcept override;
  void save(StateWriter& writer) const override;
  void restore(StateReader& reader) override;
  std::span<const std::uint32_t> touched() const override { return blocks_.all; }
  Vec3 displacement_at(const Vec3& X) const noexcept override;
  void displacements_at(std::span<const Vec3> X, std::span<Vec3> u) noexcept override;

 private:
  // A fifth of the way to a fold: two or three steps for a needle's large motions. More converge to a flow, not to a
  // hyperelastic solid.
  static constexpr double kReach = 0.2;
  // Of a correction's force, in needle radii and no more than landmarks' distances allow, so that each is local.
  static constexpr double kWidestCore = 4, kLeastCore = 0.5, kOfDistance = 0.5;
  static constexpr double kCorrectionReach = 0.6;
  static constexpr std::size_t kCorrections = 2;  // at most

  struct Step {
    double scale = 0, begin = 0;  // its own, and the share of the way before it
    std::optional<Vec3> weakest;  // where it would fold first
    NeedleRings rings;
    std::vector<Vec3> forces;  // of each ring, N
    std::vector<NearField::Piece> pieces;
  };

  /// A point of the tissue, by block.
  struct PointAt {
    std::uint32_t block, index;
  };

  void place_rings() noexcept;
  void prepare_forces() noexcept;
  bool prepare_correction() noexcept;
  double find_misses() noexcept;
  void solve_correction(double worst, NeedleRings& rings) noexcept;
  void limit_reach(Step& step, std::size_t first) const noexcept;
  double correction_core(std::size_t landmark) const noexcept;
  void find_correction_blocks(const NeedleRings& points) noexcept;
  void find_images() noexcept;
  void begin_lots(std::size_t lot) noexcept;
  Allowance allowance() const noexcept;
  void choose_blocks(std::uint64_t work) noexcept;
  void note_motion() noexcept;
  void spread_motion() noexcept;
  void carry(CentredPoints& points, std::size_t count, std::size_t together) noexcept;
  void find_lags() noexcept;
  void evaluate_block(std::uint32_t b, std::vector<NearSource>& sources) noexcept;
  /// Blocks with the least determinants of the points that were sampled, each with that.
  using WorstBlocks = std::array<std::pair<double, std::uint32_t>, WorkBudget::kRefinedBlocks>;
  void find_least_determinant() noexcept;
  void take_least_determinant() noexcept;
  void choose_refined(const WorstBlocks& worst, const Allowance& may) noexcept;
  void determinants(std::span<const PointAt> points, double* det) noexcept;
  std::uint32_t block_at(const Vec3& x, double reached) const noexcept;
  double determinant_at(const Vec3& X) noexcept;

  const Tissue& tissue_;
  const MatrixKernelField& field_;
  std::optional<SmoothCells> smooth_cells_;
  std::vector<MatrixKernelCells> cells_;  // of each step

  /// R, mm.
  struct SmoothAt {
    std::vector<Vec3> landmarks, rings;
    std::vector<Vec3> blocks;                // at a point of each block, …
    std::vector<double> block_determinants;  // … and det(I + ∇R) in its middle
  };
  SmoothAt smooth_;
  std::size_t max_steps_;
  std::vector<Step> steps_;  // of which count_ are accepted; the next is a trial
  std::size_t count_ = 0;
  double largest_ = 0;  // of the landmarks' displacements, mm
  double missed_ = 0;   // mm, by what is composed

  /// Landmarks that are carried together.
  struct Lot {
    BlockPoints<float> X;
    Block box;
  };
  struct Carried {
    std::vector<Lot> lots;
    std::size_t steps = 0;     // by which they are carried already
    std::vector<Vec3> images;  // φ of the landmarks, mm
  };
  Carried carried_;
  struct Correction {
    bool is_on = false;                   // the next step is one
    std::vector<Vec3> misses, forces;     // of the landmarks, mm, N
    std::vector<double> cores;            // mm; empty until one is asked for
    std::vector<std::uint32_t> close;     // of each landmark, those whose correction it feels, …
    std::vector<Mat3> close_blocks;       // … what a force there does to it, mm/N, …
    std::vector<std::size_t> close_ends;  // … and where they end
    std::vector<double> own_blocks;       // what a landmark's own force does, mm/N
    bool has_blocks = false;              // of these landmarks, where the steps have carried them
    NeedleRings of_steps;                 // the points of the steps' own correction, at rest
    std::vector<Vec3> near_forces;        // of the rings and of these points, N
  };
  Correction correction_;

  /// What a block shows.
  struct Shown {
    bool is_present = false;    ///< what was begun last
    float lag_mm = 0;           ///< else how far its sample is from there, where that was asked
    float least_det = 1;        ///< of its points whose determinants were asked when it was evaluated, …
    std::uint32_t weakest = 0;  ///< … and the one that has it
    std::uint32_t sample = 0;   ///< the point that moved most when it was evaluated
    float moved_beside_mm =
        0;  ///< how far landmarks beside it have gone since then, the farthest in each tick

    template <class Archive>
    void list_state(Archive& archive) {
      archive(is_present, lag_mm, least_det, weakest, sample, moved_beside_mm);
    }
  };

  WorkBudget budget_;
  struct Blocks {
    std::vector<std::uint32_t> all;
    std::vector<Shown> shown;          // of each block
    std::vector<Vec3> last_landmarks;  // where begin had them, mm
    std::vector<std::pair<Vec3, double>>
        movers;                         // of those now: where, at rest, and how far they have gone, mm
    std::vector<std::uint32_t> chosen;  // that this tick evaluates
    std::size_t wanted = 0;             // that it would, had it time for all
    bool is_unfinished = false;
    double lag_mm = 0;
    std::vector<std::uint32_t> refined;  // whose determinants are all taken
  };
  Blocks blocks_;
  std::vector<std::vector<NearSource>> sources_;  // one for each thread
};

}  // namespace brachy
