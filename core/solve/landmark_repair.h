#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"
#include "core/solve/factor_status.h"

namespace brachy {

/// Coincident landmarks agree if their displacements differ by at most this, mm: no more than a displaced mesh
/// resolves in single precision. Otherwise they contradict each other.
inline constexpr double kSameDisplacement = 1e-5;

/// Two coincident landmarks.
struct Duplicates {
  std::size_t first = 0, second = 0;  ///< first < second
  bool agree = false;                 ///< their displacements agree
};

/// The first landmark from index `from` on with an earlier one less than `distance` mm away, and the first such;
/// nothing if there is none. `positions`, `displacements`: n, mm.
std::optional<Duplicates> find_duplicates(std::span<const Vec3> positions,
                                          std::span<const Vec3> displacements, double distance,
                                          std::size_t from = 0) noexcept;

/// What was done to a tick's landmarks so that they can be solved.
enum class Repaired {
  kNothing,  ///< there is nothing to be done
  kMerged,   ///< two coincident ones that agree became one
  kDropped,  ///< some are left out: contradictory, or too close together for a stable solve
};

/// Makes a tick's landmarks solvable, one refusal at a time: the anchors first, then the needle's in order, its tip
/// last.
///
/// Of two coincident landmarks (kDuplicate), and of the closest two where the set as a whole is refused
/// (kNotPositiveDefinite, kIllConditioned), one is removed: the anchor rather than the needle's, the later of two
/// anchors, the earlier of two on the needle, so that the tip always stays. A second refusal of the whole set removes
/// two, a third four and so on, so that a tick makes a few attempts at most, however many are too close.
/// Threads: one. Real-time: no allocation, no exceptions.
class LandmarkRepair {
 public:
  /// `positions`, `displacements` (n, mm) are changed in place; the first `anchors` are anchors. `removed`, with
  /// space for n, receives what every drop removes: indices in order, each of the set as it was just before.
  LandmarkRepair(std::vector<Vec3>& positions, std::vector<Vec3>& displacements, std::size_t anchors,
                 std::vector<std::size_t>* removed = nullptr)
      : positions_(positions), displacements_(displacements), anchors_(anchors), removed_(removed) {}

  /// Removes what the solver refused with `why`.
  Repaired drop(const FactorStatus& why) noexcept;

 private:
  Repaired remove_one_of(const Duplicates& pair) noexcept;
  Duplicates closest_pair() const noexcept;

  std::vector<Vec3>&positions_, &displacements_;
  std::size_t anchors_;
  std::vector<std::size_t>* removed_;
  std::size_t crowded_ = 1;  // how many the next refusal of the whole set removes
};

}  // namespace brachy
