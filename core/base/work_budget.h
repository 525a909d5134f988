#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace brachy {

/// What a unit of a tick's work costs on one core. The defaults are the stored table: fitted to ticks of many stirred
/// needles (`brachy_bench --benchmark_filter='rest_|stir_'`) on the machine of core/DESIGN.md, section 7. A scene may
/// give another machine's figures ([work_costs]; `brachyd doctor` prints them). They belong to what a run computes: a
/// replay with the same scene has the same bits on any machine.
struct WorkCosts {
  double system_s = 2e-4;              ///< a tick before any landmark, with its determinants, s
  double landmark_s = 4e-6;            ///< contact, system and field of a landmark, s
  double landmark_pair_s = 1.5e-7;     ///< a pair of its landmarks, s
  double step_s = 1.1e-4;              ///< a sub-step but for blocks and certificate, s
  double certificate_pair_s = 2.5e-8;  ///< a pair of a lattice and a source in the search for folds, s
  /// The field at a block's points by one ring in one sub-step, how many in a second.
  double block_ring_steps_per_s = 5.2e7;
  /// Rings whose time a step takes at a block besides its own, and the block itself with its determinants.
  static constexpr std::size_t kStepRings = 10, kBlockRings = 40;
  /// Blocks whose time it takes to find how far every one of them lags (MatrixComposition), as one in so many.
  static constexpr std::size_t kLagBlocks = 32;

  // Of the certificate's other work, in its pairs.
  static constexpr std::uint64_t kLatticePairs = 12;   ///< the bounds at a lattice
  static constexpr std::size_t kSourcesForPair = 8;    ///< sources of which a cell is bounded for one pair
  static constexpr std::size_t kBlendCentrePairs = 4;  ///< a blended field in the middle of a cell
  // Of a ψ kernel's field, in direct pairs of a point and a landmark.
  static constexpr std::uint64_t kBuildPair = 3;  ///< a pair in double with its share of a column
  /// Columns applied in the time of one pair, out of cache.
  static constexpr std::uint64_t kColumnsForPair = 6;
  static constexpr std::uint64_t kColumnsBuiltForPair = 3;  ///< columns updated in the time of one pair

  /// All of them on a machine that takes `factor` times as long.
  WorkCosts slower_by(double factor) const;
  bool operator==(const WorkCosts&) const = default;
};

/// What a tick has counted so far. Each question of WorkBudget::allowance fills in what its answer depends on.
struct TickWork {
  std::size_t needles = 0;          ///< with landmarks
  std::size_t landmarks = 0;        ///< in the landmarks' system
  std::size_t steps = 0;            ///< sub-steps: those composed so far, or the last field's
  std::size_t sources = 0;          ///< of one sub-step: rings of a matrix model, landmarks of a ψ kernel
  std::size_t step_sources = 0;     ///< the sum of the sources of all sub-steps
  bool reaches_everywhere = false;  ///< every source counts in every cell (CellField)
  bool is_undecided = false;        ///< a part of the tick's field was neither certified nor seen to fold
  std::uint64_t certificate_pairs = 0;  ///< spent in this tick
  std::size_t blocks = 0;  ///< of the tissue, or before they are known those that the last tick wanted
};

/// What the tick may still do.
struct Allowance {
  bool puts_resting_needles_first = false;  ///< in the landmarks' system, so that their rows stay factored
  bool may_find_field = true;               ///< false: this tick has the forces, the next one the field
  std::size_t steps = 1;                    ///< sub-steps of the landmarks' way, at least 1
  bool may_add_step = true;             ///< false: landmarks are clamped to where the steps so far take them
  bool may_correct_steps = true;        ///< false: only what follows the steps is corrected, not each of them
  double correction_reach = 0;          ///< roots of a correction's s beyond which it is not felt
  bool may_renew_corrections = true;    ///< false: a second correction uses what was found for the first
  std::size_t correction_sweeps = 0;    ///< of Gauss and Seidel
  std::size_t step_tries = 0;           ///< to certify a step, each shorter than the one before
  bool may_certify = true;              ///< false: folds are looked for, and the tick stays uncertified
  std::uint64_t certificate_pairs = 0;  ///< of the next search
  std::uint64_t margin_pairs = 0;       ///< of it, if it only measures the margin
  std::uint64_t resting_pairs = 0;      ///< of searches that go on where the field stays as it is
  std::size_t candidate_stride = 1;     ///< every so many sources one is asked where it folds first
  std::size_t strongest_candidates = 0;  ///< instead: so many of the strongest sources; 0: by number
  bool may_sum_single_rings = true;      ///< false: gradients in double sum pieces of shafts, as blocks do
  std::size_t blocks = 0;                ///< whose points are evaluated; the others wait
  std::size_t whole_blocks = 0;          ///< if these are all that lag, they are evaluated instead
  std::size_t easy_blocks = 0;           ///< of these, that are evaluated however little they lag
  double lag_mm = 0;               ///< by which a block may lag behind the landmarks before it counts as late
  std::size_t close_stride = 1;    ///< every so many points close to a needle one has its determinant asked
  std::size_t refined_blocks = 1;  ///< blocks of which every point has
  std::size_t weakest_steps = 0;   ///< steps around whose weakest place every point has
};

/// The owner of a tick's work: all limits of a tick stand here, and `allowance` is the one answer to "what may this
/// tick still do?". Work is counted, never timed, so the same poses give the same bits.
///
/// The order in which work has precedence; what comes last gives way first:
///
///   1. Forces. Contact and the landmarks' system are solved whole. Where the field does not fit into the same tick,
///      forces and field take turns: one tick has new forces, the next one the field of its landmarks.
///   2. The field where it lags. The landmarks' way is gone in fewer and longer sub-steps, corrections become
///      coarser, and in the end landmarks are clamped. Blocks that lag most are evaluated before others.
///   3. The certificate, in what they leave of `whole_share`. A step that is not certified is tried again, shorter;
///      then folds are only looked for, and the tick is flagged (kStepUncertified). Fewer points have their
///      determinants asked. Where nothing moves any more, ticks go on with the searches until all are decided.
///   4. The far field. What the period has left after 1 to 3 goes to blocks. Beyond a light tick's share they are those
///      that lag; what is left out stays where an earlier tick put it, which the tick tells where it is more than
///      `lag_mm` (kStepLate), and follows when nothing moves.
///
/// Shares of the period: blocks, and whether the field fits into the forces' tick (`light_share` to `rest_share`).
/// Everything else is a count for a tick of any length, so a tick of 1 ms may do as much as one of 5
/// ms. Counts whose comment names a cost are those of the stored table: where that cost is twice as high, a tick may
/// do half as many. The other counts choose between methods and do not depend on costs.
struct WorkBudget {
  double period_s = 1.0 / 200;  ///< of a tick, > 0
  WorkCosts costs = {};
  /// Field and blocks of every tick are evaluated whatever that takes: not in real time, but what `lag_mm` is off.
  bool is_whole = false;

  // Forces and field in one tick.
  /// Landmarks up to which they are never parted: those of three or four needles.
  std::size_t few_field_landmarks = 24;
  /// Needles up to which the landmarks' system takes them by number: with so few, ordering does not pay.
  std::size_t few_needles = 3;

  // Sub-steps of a matrix model. The cost of all these counts is block_ring_steps_per_s.
  /// Rings × steps; beyond it the steps are longer: three needles in three steps.
  std::size_t step_rings = 400;
  /// Rings × steps, beyond which landmarks are clamped: sixteen needles in four.
  std::size_t most_step_rings = 1500;
  std::size_t corrected_rings = 250;  ///< rings, beyond which steps have no correction of their own
  /// Landmarks up to which a correction is felt as far as 1 % of it, and found again for each correction.
  std::size_t few_corrected_landmarks = 40;
  double correction_reach = 10;  ///< roots of s: beyond it others feel less than 1 % of a correction
  /// The same of many landmarks: 2 %; what they miss by it is found after.
  double short_correction_reach = 7;
  std::size_t correction_sweeps = 16;  ///< a diagonal that dominates needs fewer

  // The certificate, in pairs of InjectivitySearch; certificate_pair_s. Of 5 ms a search may take 4 %, all of them 16.
  std::uint64_t search_pairs = 8000;  ///< of one search: 0.2 ms; beyond it a field is uncertified
  std::uint64_t tick_pairs = 32000;   ///< of all of a tick: 0.8 ms; beyond it, steps are uncertified
  std::uint64_t margin_pairs = 1000;  ///< of a search for the margin alone; beyond it the margin is 0
  /// Of a search for folds in a field that cannot be certified, or in a tick that would be late if it were.
  std::uint64_t fold_pairs = 1000;
  std::size_t certified_sources = 140;  ///< that reach everywhere and that `search_pairs` can certify
  std::size_t step_tries = 2;           ///< a step that could not be certified is tried once more, shorter

  // Where folds are looked for. Fewer candidates would miss folds: these do not depend on costs.
  std::size_t candidates = 12;              ///< sources, by number; of four needles these were too few
  std::size_t few_candidate_sources = 155;  ///< up to three needles' sources: candidates are taken by number
  std::size_t strongest_candidates = 8;     ///< of more sources: the strongest of as many pieces of shafts

  // Determinants at vertices, by rings × steps of what is composed; block_ring_steps_per_s.
  /// For each of these, of the points close to a needle one in one more is asked.
  std::size_t close_step_rings = 100;
  std::size_t refined_step_rings = 1200;  ///< shared by the blocks that are asked point by point
  std::size_t weakest_step_rings = 1000;  ///< beyond it, only the first step's weakest place is looked at
  static constexpr std::size_t kRefinedBlocks = 6;  ///< at most
  /// Of a block's points far from needles, one in so many is asked.
  static constexpr std::uint32_t kPointStride = 16;

  // The points of the tissue, block by block: what shares of the period leave besides system, certificate and steps by
  // WorkCosts. The rest of the period is for snapshots, other threads, and ticks that are dearer than the table.
  double light_share = 0.3;  ///< 1.5 ms at 200 Hz: so much is done though nothing would be late without it
  double work_share = 0.6;   ///< 3 ms at 200 Hz
  /// 3.5 ms: where that makes nothing late it is done; else no more than work_share.
  double whole_share = 0.7;
  double rest_share = 0.75;             ///< 3.75 ms, where nothing moves and only certificates are left
  std::size_t least_blocks_share = 12;  ///< in any case one in so many blocks is evaluated
  double lag_mm = 0.008;  ///< of one point; of others beside it up to ten times as much was seen

  static constexpr std::size_t kUsualCorrections = 1;  ///< expected after the steps of the way
  static constexpr std::size_t kWantedTicks = 16;  ///< by which it is forgotten that all blocks were wanted
  /// Landmarks no farther from a block than this may move points of it more than the one that is asked …
  static constexpr double kBesideMm = 8;
  static constexpr float kMovedShare = 0.5F;  ///< … and by this of their own way at least, it is taken

  /// Block pivots of stick and slip (ReactionSolver); beyond, a tick is flagged kStepSlipUnsettled. Sets settle in a
  /// handful.
  static constexpr int kReactionPivots = 200;
  /// In a search of the certificate a cell whose bound is positive, but below this share of the least determinant
  /// found, is refined while less than one in kRefiningPart of the search's pairs is spent: for a tighter bound.
  static constexpr double kRefinedBoundShare = 0.05;
  static constexpr std::uint64_t kRefiningPart = 4;

  /// What a tick that has done `work` may still do. Real-time: some divisions.
  Allowance allowance(const TickWork& work) const noexcept;

 private:
  double time_left(double share, const TickWork& work) const noexcept;
};

/// Where one of two ways of computing the same is the faster one, by measurement (`brachy_bench`). Results differ by
/// rounding at most; which way is taken depends on counts alone, not on a machine's costs, so bits are the same.
struct SpeedThresholds {
  // The landmarks' system.
  static constexpr std::ptrdiff_t kPanelRows = 120;  ///< from so many rows on, K is factored by panels
  /// From so many on, rows of K may be ordered by a sweep. Below, a dense factor is so cheap that it does not pay.
  static constexpr int kSparseLandmarks = 256;
  /// Largest share of a dense factorisation's operations at which the envelope is used: above, it gains little and
  /// gives up the landmarks' own order.
  static constexpr double kSparseFill = 0.6;
  static constexpr int kSparseChanges = 8;  ///< landmarks replaced one by one; each costs up to a tenth
  static constexpr int kSweepWindow = 48;   ///< rows that are sorted by reach: three panels
  // Threads of a ψ kernel's field. Fork and join take 1 µs on free cores, but a scheduler slice of 8 ms on taken ones,
  // so only ticks of some milliseconds are shared out.
  static constexpr std::uint64_t kPairsForThreads = 4'000'000;    ///< of points and landmarks
  static constexpr std::uint64_t kColumnsForThreads = 4'000'000;  ///< of points and condensed columns
  // Condensed evaluation of a ψ kernel's field.
  static constexpr int kSettleTicks = 4;  ///< landmarks rest so long before it is prepared
  /// Of K⁻¹: together they cost as much as a solve for weights.
  static constexpr std::size_t kColumnsATick = 3;
  /// Diagonal of a block, in support radii, up to which its own box culls as well as its groups' less their cost: a
  /// tenth more pairs, but longer runs.
  static constexpr double kDenseDiagonal = 0.35;
};

}  // namespace brachy
