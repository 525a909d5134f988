#pragma once

#include <cstddef>

namespace brachy {

/// A transrectal ultrasound probe. Lengths in mm.
struct ProbeSettings {
  bool on = false;          ///< it is in the scene: the instrument after the needles
  double diameter_mm = 20;  ///< of a biplane endorectal probe
  double length_mm = 150;
  double rectal_wall_mm = 4;  ///< between probe and gland; as far as the phantom's rectum lies behind it
  /// What rectum and pelvic floor beside the gland take for each mm that the probe pushes: an assumption, with which
  /// 30 N move the peripheral zone of a gland that moves (GlandSettings) by about 12 mm.
  double surroundings_n_per_mm = 2.2;
  double landmark_spacing_mm = 5;  ///< between points of the gland's surface that it may push
  static constexpr std::size_t kMaxLandmarks = 64;

  bool operator==(const ProbeSettings&) const = default;
};

}  // namespace brachy
