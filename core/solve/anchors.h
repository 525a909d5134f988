#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/rigid_transform.h"

namespace brachy {

/// The paper's anchors (section 2.2): landmarks with displacement 0 at k surface points scaled by λ about the
/// centroid. λ is λ_rest at rest; under load it shrinks towards λ_loaded, and returns to λ_rest bit for bit.
/// Threads: one. Real-time: no allocation after construction.
class Anchors {
 public:
  struct Options {
    std::size_t count = 8;
    double lambda_rest = 0.5;    ///< in (0, 1)
    double lambda_loaded = 0.5;  ///< in (0, λ_rest]: λ under full load; equal to λ_rest: λ never moves
    double relaxation_s = 0.2;   ///< time to cross from one to the other
    /// an anchor this near to a needle's line is moved aside: it would fold the field
    double clearance_mm = 5;
    std::uint64_t seed = 1;

    bool operator==(const Options&) const = default;
  };

  /// Chooses `options.count` distinct points of `surface_vertices` (mm); the same ones for the same seed, anywhere.
  Anchors(std::span<const Vec3> surface_vertices, const Options& options);

  /// Moves λ towards its target for `load` in [0, 1] over `period_s` seconds and places the anchors.
  void update(double load, double period_s) noexcept;

  /// Rest positions of the anchors now, mm.
  std::span<const Vec3> positions() const { return positions_; }
  double lambda() const { return lambda_; }

  /// For StateWriter and StateReader (core/base/state_archive.h).
  template <class Archive>
  void list_state(Archive& archive) {
    archive(lambda_, positions_);
  }

 private:
  void place() noexcept;

  Options options_;
  double lambda_;
  Vec3 centroid_ = Vec3::Zero();
  std::vector<Vec3> surface_points_;
  std::vector<Vec3> positions_;
};

}  // namespace brachy
