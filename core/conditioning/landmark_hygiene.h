#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/conditioning/factor_status.h"
#include "core/math/rigid_transform.h"

namespace brachy {

/// Landmarks at one place say the same when their displacements differ by at most this, mm: no more than a displaced mesh
/// resolves in single precision. Otherwise they contradict each other.
inline constexpr double kSameDisplacement = 1e-5;

/// Two landmarks at one place.
struct Twins {
  std::size_t first = 0, second = 0;  ///< first < second
  bool agree = false;                 ///< they say the same
};

/// The first landmark from index `from` on with an earlier one less than `distance` mm away, and the first such; nothing if
/// there is none. `positions`, `displacements`: n, mm.
std::optional<Twins> find_twins(std::span<const Vec3> positions, std::span<const Vec3> displacements,
                                double distance, std::size_t from = 0) noexcept;

/// What was done to a tick's landmarks so that they can be solved.
enum class Mended {
  kNothing,  ///< there is nothing to be done
  kMerged,   ///< two that say the same at the same place are one
  kDropped,  ///< some are left out: contradictory, or too close together for a stable solve
};

/// Makes a tick's landmarks solvable, one refusal at a time: the anchors first, then the needle's in order, its tip last.
///
/// Of two at one place (kDuplicate), and of the closest two where the set as a whole is refused (kNotPositiveDefinite,
/// kIllConditioned), an anchor gives way to the needle, the later of two anchors to the earlier, and on the needle the
/// earlier to the later: the tip always stays. What is left is the same set without its crowding. A second refusal of the
/// whole set takes two out, a third four and so on, so that a tick tries a few times at most, however many are crowded.
/// Threads: one. Real-time: no allocation, no exceptions.
class LandmarkMender {
 public:
  /// `positions`, `displacements` (n, mm) are changed in place; the first `anchors` are anchors. `taken_out`, with room for
  /// n, gets what every mend takes out: indices in order, each of the set as it was just before.
  LandmarkMender(std::vector<Vec3>& positions, std::vector<Vec3>& displacements, std::size_t anchors,
                 std::vector<std::size_t>* taken_out = nullptr)
      : positions_(positions), displacements_(displacements), anchors_(anchors), taken_out_(taken_out) {}

  /// Takes out what the solver refused with `why`.
  Mended mend(const FactorStatus& why) noexcept;

 private:
  Mended take_out_one_of(const Twins& pair) noexcept;
  Twins closest_pair() const noexcept;

  std::vector<Vec3>&positions_, &displacements_;
  std::size_t anchors_;
  std::vector<std::size_t>* taken_out_;
  std::size_t crowded_ = 1;  // how many the next refusal of the whole set takes out
};

}  // namespace brachy
