#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/brachytherapy/seeds/seed.h"
#include "core/simulation/mesh_state.h"
#include "core/ultrasound/image_plane.h"
#include "core/ultrasound/point_spread.h"

namespace brachy {

/// The echoes and shadows of needles and seeds: metal cylinders, seen by the surface that faces the probe.
///
/// A cylinder is cut into short pieces. One that lies e across the plane returns pressure by the slice's Gaussian in e
/// and by cosⁿ of the angle between beam and its surface's normal, plus a share in all directions; echoes from within
/// the metal follow behind it at even distances, each weaker. It takes from what lies behind as much of the beam's
/// cross-section as it covers. The tip of a needle returns more (its edge), with no regard to the angle. Between two
/// seeds that fell one after the other lie the spacers of their train, where the gap is as long as some and in line
/// with both: weak, without echoes from within and without shadow.
/// Threads: one. Real-time: no allocation after construction.
class InstrumentEchoes {
 public:
  InstrumentEchoes(const UltrasoundSettings& settings, const ImagePlane& plane, double needle_length_mm,
                   double needle_radius_mm, std::size_t max_needles, std::size_t max_seeds);

  /// Finds them for the plane at X_WI.
  void find(const RigidTransform& X_WI, std::span<const NeedleState> needles, std::span<const Seed> seeds,
            const PointSpread& spread) noexcept;

  /// Adds what they take, dB, to `loss` (lines × (segments + 1)), at the node behind.
  void add_losses(const PointSpread& spread, std::size_t segments, std::span<float> loss) const noexcept;

  struct Echo {
    float line, depth, pressure;  ///< depth in mm
  };
  std::span<const Echo> echoes() const { return {echoes_.data(), echo_count_}; }

 private:
  struct Look {
    double echo_db, radius, power, diffuse, reverberation;
    int repeats;
    bool has_shadow = true;
  };
  struct Shadow {
    double line, depth, area;
  };
  void add_course(const RigidTransform& X_IW, const NeedleState& needle, const Look& look,
                  const PointSpread& spread) noexcept;
  void add_spacers(const RigidTransform& X_IW, const Seed& a, const Seed& b,
                   const PointSpread& spread) noexcept;
  void add_piece(const RigidTransform& X_IW, const Vec3& begins, const Vec3& ends, const Look& look,
                 const PointSpread& spread) noexcept;
  void add_point(const Vec3& p_I, double pressure, const Look& look) noexcept;
  void add_echo(const PlanePoint& p, double pressure) noexcept;

  const ImagePlane& plane_;
  double shadow_db_, length_, radius_, needle_db_, seed_db_, spacer_db_;
  std::vector<Echo> echoes_;
  std::size_t echo_count_ = 0;
  std::vector<Shadow> shadows_;
  std::size_t shadow_count_ = 0;
};

}  // namespace brachy
