#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/brachytherapy/seeds/seed.h"
#include "core/brachytherapy/seeds/seed_drop.h"
#include "core/injectivity/certificate.h"
#include "core/models/displacement_field.h"

namespace brachy {

/// The seeds in the tissue: adds new ones at their material points and moves all of them with the tissue
/// (core/DESIGN.md, section 6). None is ever removed.
/// Threads: one. Real-time: no allocation after construction and restore, no exceptions.
class Implant {
 public:
  explicit Implant(std::size_t max_count);

  /// Seeds of an earlier run, in their order, before the first tick. Throws UserError where they are too many.
  void restore(std::span<const Seed> seeds);

  /// Drops a seed: `seed` has what is known of it when it falls, `dropped` and `dropped_axis` above all. Finds its
  /// material point in `field` (whose verdict is given), starting at the needle's material tip; otherwise returns the
  /// reason and drops nothing.
  DropRefusal drop(Seed seed, const DisplacementField& field, Verdict verdict,
                   const Vec3& material_tip) noexcept;

  /// Moves the seeds with `field`.
  void move(std::uint64_t tick, const DisplacementField& field) noexcept;

  std::span<const Seed> seeds() const { return seeds_; }
  std::size_t max_count() const { return max_count_; }
  /// The last tick in which seed i was dropped or moved; 0: restored and at rest since.
  std::uint64_t changed_tick(std::size_t i) const { return changed_[i]; }

 private:
  std::size_t max_count_;
  std::vector<Seed> seeds_;
  std::vector<std::uint64_t> changed_;
};

}  // namespace brachy
