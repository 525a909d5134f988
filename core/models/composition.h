#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/state_archive.h"
#include "core/base/work_budget.h"
#include "core/injectivity/cell_field.h"
#include "core/models/displacement_field.h"

namespace brachy {

/// Sub-steps composed: φ = φ_m ∘ … ∘ φ_1, φ_k = id + s_k u_k, with the landmarks carried along straight lines from rest
/// to where they are now. If every step is injective so is φ, and its inverse is that of the steps. Nothing is carried
/// over from tick to tick: the same landmarks give the same bits. As a DisplacementField it is φ(X) − X, valid after
/// evaluate().
/// Threads: one. Real-time: no allocation after construction.
class Composition : public DisplacementField {
 public:
  /// Whether φ is the model's field in any case; or only where one step of the model's own would fold.
  virtual bool is_always_used() const = 0;
  /// Share of the way to the nearest candidate of a fold that a step may go.
  virtual double reach() const = 0;

  /// Starts again: landmarks at rest. Both must stay as they are until evaluate is done. Returns a lower bound of the
  /// determinant of what φ begins with before the first step, 1 where that is nothing; not above 0 where none is known.
  virtual double begin(std::span<const Vec3> positions, std::span<const Vec3> displacements) noexcept = 0;
  /// The same field for the certificate, where that bound does not do; null: nothing.
  virtual const CellField* cells_of_beginning() const { return nullptr; }
  /// Makes the field of the next step. False: φ is complete, or there is none.
  virtual bool next() noexcept = 0;
  /// That field, unscaled: for the certificate.
  virtual const CellField& cells() const = 0;
  /// How many steps' fields stay as they are until begin is called again, so that their certificates may go on later;
  /// 0: cells() is one field for all steps.
  virtual std::size_t kept_fields() const { return 0; }
  /// Whether it is the last step's but for its place, so that it folds at the same scale.
  virtual bool is_like_last() const = 0;
  /// The scale of it that completes φ. It need not be a share of the landmarks' way.
  virtual double rest() const = 0;
  /// Adds the step, at `scale` ≤ rest(). `weakest`: where it would fold first if it went on; null: nowhere near.
  virtual void accept(double scale, const Vec3* weakest) noexcept = 0;
  /// Share of the landmarks' way that is composed, 0 … 1.
  double reached() const { return reached_; }
  /// How far the tissue at a landmark is at most from where it belongs once next() has returned false, mm.
  virtual double missed_mm() const = 0;
  std::size_t steps() const { return way_steps_; }  ///< of the landmarks' way
  /// Of these, that a tick has time for with what has begun; at least 1. Counted, not timed.
  virtual std::size_t most_steps() const { return std::numeric_limits<std::size_t>::max(); }

  /// φ at the tissue's points, and the least det ∇φ among all that are shown (at most 1). Blocks for which a tick has
  /// no time, by count, stay where an earlier evaluate has put them. `work`: what the tick's certificates took
  /// (InjectivitySearch::Result), which leaves less.
  virtual void evaluate(std::uint64_t work) noexcept = 0;
  /// Whether there are such. evaluate() goes on with them, while begin is not called.
  virtual bool is_unfinished() const { return false; }
  /// How far the points of these lag behind φ, mm: the most, of one point of each block. Others may lag more
  /// (core/README.md, Limits).
  virtual double lag_mm() const { return 0; }
  /// Whether that is more than WorkBudget::lag_mm.
  virtual bool is_late() const { return false; }
  /// As many blocks as the last evaluate() wanted to bring up to date, had it had time for all; and sets that, where a
  /// run goes on from a saved state. Depends on earlier ticks.
  virtual std::size_t wanted_blocks() const { return 0; }
  virtual void expect_blocks(std::size_t /*wanted*/) {}
  /// What evaluate() will take if the landmarks' way has `steps` steps, with wanted_blocks(); nothing where it
  /// does all of them in any case.
  virtual TickWork work_ahead(std::size_t /*steps*/) const { return {}; }
  /// No landmark is there any more: the tissue is at rest, and the next evaluate starts from there.
  virtual void end() noexcept {}
  /// What the tissue's points still show of earlier landmarks, where blocks are late. As TissueField's.
  virtual void save(StateWriter& /*writer*/) const {}
  virtual void restore(StateReader& /*reader*/) {}
  double least_determinant() const { return least_determinant_; }
  const Vec3& least_place() const { return least_place_; }  ///< rest position of that point
  const BlockDisplacement<float>& displacement(std::uint32_t block) const override {
    return displacements_[block];
  }

 protected:
  explicit Composition(std::size_t blocks) : displacements_(blocks) {}

  void begin_way(std::span<const Vec3> positions, std::span<const Vec3> displacements) {
    positions_ = positions;
    landmark_displacements_ = displacements;
    reached_ = 0;
    way_steps_ = 0;
  }
  void go_on(double scale) {
    reached_ = scale >= 1 - reached_ ? 1 : reached_ + scale;
    ++way_steps_;
  }

  std::span<const Vec3> positions_, landmark_displacements_;  // at rest, and from there

  // of evaluate:
  std::vector<BlockDisplacement<float>> displacements_;
  double least_determinant_ = 1;
  Vec3 least_place_ = Vec3::Zero();

 private:
  double reached_ = 0;
  std::size_t way_steps_ = 0;
};

}  // namespace brachy
