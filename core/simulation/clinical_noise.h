#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// What keeps a perfect hand's needles and seeds from where they should be, in the clinic: 1,197 seeds were off by 1.3,
/// 1.5 and 3.8 mm (SD; left–right, antero-posterior, along the needle), 4.9 mm in the mean. The parts are assumptions
/// that together give about that, beside needles that bend and a gland that moves. Lengths are standard deviations.
struct NoiseSettings {
  bool on = false;
  std::uint64_t seed = 1;
  double template_play_mm = 0.7;  ///< across, of each insertion: the needle in its hole
  double tremor_mm = 0.1;         ///< of the hand, 8 to 12 Hz, in each direction
  /// Of all needles together, along each: as catheters drift between fractions, 1.8 mm (0 ± 1.8, craniocaudal; the
  /// source is UncertaintySettings'). 0: they were not left.
  double drift_mm = 0;
  double stop_s = 0.03;        ///< times the insertion's speed: where the hand stops along the needle
  double drop_along_mm = 1.8;  ///< of each seed: ejection and stylet
  double drop_across_mm = 1.2;
  double migration_along_mm = 1.5;  ///< of each seed, with the tissue that closes behind the needle

  bool operator==(const NoiseSettings&) const = default;
};

/// Clinical noise, from its seed, the simulated time and what it is about alone: the same bits on every run, whatever
/// is asked for first. Nothing where it is off.
/// Threads: one. Real-time: no allocation after construction.
class ClinicalNoise {
 public:
  ClinicalNoise(const NoiseSettings& settings, std::size_t needles);

  bool is_on() const { return settings_.on; }
  /// The needle's pose as the hand really holds it, `t_s` into the session. `is_in_tissue`: after the last tick; each
  /// insertion is drawn by itself.
  RigidTransform held(std::size_t needle, const RigidTransform& X_WN, double t_s, double period_s,
                      bool is_in_tissue) noexcept;
  /// How far from the needle's tip seed `id` comes to lie, mm; `axis` along the needle, towards the tip.
  Vec3 drop_offset(std::uint32_t id, const Vec3& axis) const noexcept;

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(hands_);
  }

 private:
  struct Hand {
    std::uint64_t insertion = 0;
    bool was_in_tissue = false, is_known = false;
    Vec3 last_tip = Vec3::Zero();
    double fastest_mm_s = 0;  // of this insertion, forward

    template <class Archive>
    void list_state(Archive& archive) {
      archive(insertion, was_in_tissue, is_known, last_tip, fastest_mm_s);
    }
  };

  /// Standard normal, of the numbers alone.
  double normal(std::uint64_t what, std::uint64_t which, std::uint64_t component) const noexcept;

  NoiseSettings settings_;
  std::vector<Hand> hands_;
};

}  // namespace brachy
