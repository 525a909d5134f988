#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/elasticity/landmark_compliance.h"
#include "core/kernels/landmark_spread.h"

namespace brachy {

/// All landmarks of a tick: anchors, the probe's, then every needle's shaft, then the tips; of many needles, those of
/// each needle by NeedleOrder, then the probe's. Those that move come last: landmark systems recompute the rows from
/// the first that changed.
///
/// The parts are numbered (Revision), so that a model that has to know whether they are those of an earlier tick keeps
/// a number, not a copy. One set serves all ticks: clear and add, `number` before the landmarks are factorized,
/// `settle` once their displacements are final. A tick that is not settled, because its landmarks could not be solved,
/// is none that later ones are compared with.
/// Threads: a plain value; any thread may number its own sets. Real-time: no allocation within what was reserved.
class LandmarkSet {
 public:
  /// Of a landmark behind the anchors: landmark `index` of needle `needle`; the probe's is the needle after the last.
  struct Owner {
    std::uint32_t needle = 0, index = 0;

    template <class Archive>
    void list_state(Archive& archive) {
      archive(needle, index);
    }
  };

  /// The number of each part; 0: it has none. No two parts that differ have the same number, whichever sets of this
  /// process they are in. In another process a number means nothing.
  struct Revision {
    std::uint64_t positions = 0, spreads = 0, compliance = 0;
    /// Of the compliance without its beams (LandmarkCompliance::is_alike_without_beams).
    std::uint64_t held = 0;
    /// Displacements with one number differ by up to kRestToleranceMm from the first that had it, and the other parts
    /// are the same.
    std::uint64_t displacements = 0;

    bool operator==(const Revision&) const = default;
  };

  /// By rounding alone resting landmarks move by 1e-16 mm a tick: what moves by less than this rests.
  static constexpr double kRestToleranceMm = 1e-9;

  std::vector<Vec3> positions, displacements;  ///< mm, n
  std::vector<LandmarkSpread> spreads;         ///< n
  LandmarkCompliance compliance;               ///< of what gives way besides the tissue
  std::vector<Owner> owners;                   ///< n − anchors
  std::size_t anchors = 0;

  /// A settled set of these landmarks, without owners (assign).
  static LandmarkSet of(std::span<const Vec3> positions, std::span<const Vec3> displacements = {},
                        std::span<const LandmarkSpread> spreads = {},
                        const LandmarkCompliance& compliance = {});

  void reserve(std::size_t capacity);
  void clear() noexcept;
  void add(const Vec3& position, const Vec3& displacement, const LandmarkSpread& spread,
           const LandmarkCompliance::Point& point = {}) noexcept;
  /// Removes spread, owner and compliance of landmark i, which is already gone from positions and displacements.
  void remove(std::size_t i) noexcept;
  /// Makes the set one of these landmarks, without owners, and numbers and settles it. `positions` n, mm; what the
  /// others lack of n is 0, the model's own rule, nothing that gives way. They must not be this set's own.
  void assign(std::span<const Vec3> new_positions, std::span<const Vec3> new_displacements = {},
              std::span<const LandmarkSpread> new_spreads = {},
              const LandmarkCompliance& new_compliance = {});

  /// Numbers all parts but the displacements, which have no number until they are settled: a part that is the same as
  /// when it was settled last has the number of then, another one a new number. Call it after clear, add, remove or
  /// any other change of these parts.
  void number() noexcept;
  /// Numbers the displacements in the same way, and makes all that later ticks are compared with. Call it after any
  /// change of the displacements alone, too. The set is numbered.
  void settle() noexcept;
  const Revision& revision() const { return revision_; }
  /// What was settled last, with its numbers and without owners; nothing numbered, if nothing was.
  LandmarkSet last_settled() const;
  const Revision& settled_revision() const { return settled_.revision; }
  /// Whether number was called since the last change, as far as that can be told: for asserts. Takes a comparison.
  bool is_numbered() const noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h). Numbers are this process's, so what is read gets
  /// new ones.
  template <class Archive>
  void list_state(Archive& archive) {
    bool has_settled = settled_.revision != Revision(), is_settled = revision_ == settled_.revision;
    archive(positions, displacements, spreads, compliance, owners, anchors, has_settled, is_settled);
    archive(settled_.positions, settled_.displacements, settled_.spreads, settled_.compliance);
    if constexpr (Archive::kReads) renumber(has_settled, is_settled);
  }

 private:
  void renumber(bool has_settled, bool is_settled) noexcept;

  /// What the present landmarks are compared with. A part is copied where its number is new, so that displacements
  /// stay those of the first tick of their number: in steps below the tolerance nothing drifts.
  struct Settled {
    std::vector<Vec3> positions, displacements;
    std::vector<LandmarkSpread> spreads;
    LandmarkCompliance compliance;
    Revision revision;
  };

  Revision revision_;
  Settled settled_;
};

}  // namespace brachy
