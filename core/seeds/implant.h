#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/field/tissue_field.h"
#include "core/seeds/seed.h"
#include "core/seeds/seed_drop.h"
#include "core/stability/certificate.h"

namespace brachy {

/// The seeds in the tissue: takes new ones at their material points and carries all of them along (DESIGN §6). None is ever
/// taken out.
/// Threads: one. Real-time: no allocation after construction and restore, no exceptions.
class Implant {
 public:
  explicit Implant(std::size_t max_count);

  /// Seeds of an earlier run, in their order, before the first tick. Throws UserError where they are too many.
  void restore(std::span<const Seed> seeds);

  /// Leaves a seed: `seed` has what is known of it when it falls, `dropped` and `dropped_axis` above all; its material point
  /// in `field` (whose verdict is given) is found, beside the needle's material tip, or the reason returned and nothing left.
  DropRefusal drop(Seed seed, const TissueField& field, Verdict verdict, const Vec3& material_tip) noexcept;

  /// Takes the seeds to where `field` carries them.
  void move(std::uint64_t tick, const TissueField& field) noexcept;

  std::span<const Seed> seeds() const { return seeds_; }
  std::size_t max_count() const { return max_count_; }
  /// The last tick in which seed i came to be or moved; 0: restored and at rest since.
  std::uint64_t changed_tick(std::size_t i) const { return changed_[i]; }

 private:
  std::size_t max_count_;
  std::vector<Seed> seeds_;
  std::vector<std::uint64_t> changed_;
};

}  // namespace brachy
