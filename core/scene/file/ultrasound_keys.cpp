#include <limits>

#include "core/scene/file/scene_keys.h"

namespace brachy {
namespace {

using enum Reload;

std::vector<Key<UltrasoundSettings>> ultrasound_keys() {
  using S = UltrasoundSettings;
  return {
      flag("on", &S::on, kRestart, "brachyd makes images for clients that ask for them"),
      number("rate_hz", &S::rate_hz, {1, 100}, kRestart, "of the images of brachyd"),
      text("array", &S::array, {"transverse", "sagittal", "end_fire"}, kRestart,
           "of the probe, that is shown"),
      number("frequency_mhz", &S::frequency_mhz, {1, 20}, kRestart, "of the pulse's middle"),
      number("pulse_cycles", &S::pulse_cycles, {1, 10}, kRestart,
             "the axial resolution is half of that many wavelengths"),
      number("fov_deg", &S::fov_deg, {20, 340}, kRestart, "of the sector of a transverse or end_fire array"),
      number("length_mm", &S::length_mm, {10, 120}, kRestart, "of the sagittal array"),
      number("depth_mm", &S::depth_mm, {10, 150}, kRestart, "from the probe's surface"),
      number("aperture_mm", &S::aperture_mm, {1, 60}, kRestart, "active, of the focused beam"),
      number("focus_mm", &S::focus_mm, {5, 150}, kRestart, "of the transmitted beam"),
      number("elevation_mm", &S::elevation_mm, {0.1, 20}, kRestart,
             "thickness of the slice, full width at half maximum"),
      integer("planes", &S::planes, {1, 5}, kRestart, "that the slice is summed of: 1, 3 or 5"),
      integer("lines", &S::lines, {32, 1024}, kRestart, "of a scan"),
      integer("width_px", &S::width_px, {16, 2048}, kRestart, "of the image"),
      integer("height_px", &S::height_px, {16, 2048}, kRestart, "of the image"),
      number("gain_db", &S::gain_db, {-60, 60}, kRestart, "of the whole image"),
      number("tgc_extra_db_per_cm", &S::tgc_extra_db_per_cm, {-100, 100}, kRestart,
             "time gain compensation beyond what soft tissue attenuates there and back"),
      number("dynamic_range_db", &S::dynamic_range_db, {10, 120}, kRestart, "between black and white"),
      number("noise_db", &S::noise_db, {-200, 20}, kRestart,
             "of the receiver at the probe's surface, against the gland's echo"),
      number("attenuation_db_per_cm_mhz", &S::attenuation_db_per_cm_mhz, {0, 5}, kRestart,
             "of soft tissue, one way"),
      number("needle_echo_db", &S::needle_echo_db, {-60, 80}, kRestart, "of a needle across the beam"),
      number("seed_echo_db", &S::seed_echo_db, {-60, 80}, kRestart, "of a seed across the beam"),
      number("spacer_echo_db", &S::spacer_echo_db, {-60, 80}, kRestart,
             "of a spacer across the beam, between two seeds of one train"),
      number("coupling", &S::coupling, {0, 1}, kRestart,
             "share of the probe's surface that has contact; less: too little gel, shadows of air"),
      number("shadow_db", &S::shadow_db, {0, 60}, kRestart,
             "of a needle or seed that covers the whole slice, there and back"),
      flag("surroundings", &S::surroundings, kRestart,
           "bladder, pubic arch, muscle and calcifications are made up around the gland"),
      text("volume", &S::volume, {}, kRestart,
           "NRRD of the echoes at rest, such as a recorded ultrasound volume, in place of made-up tissue; "
           "its mean "
           "within the gland is drawn as the gland's level"),
      number("volume_db_per_value", &S::volume_db_per_value, {1e-6, 100}, kRestart,
             "of the volume's values; 0.235: 8 bits over 60 dB"),
      number("offset_mm", &S::offset_mm, {-200, 200}, kRestart,
             "probe without a pose: its arrays' middle, along z from the gland's"),
      number("rotation_deg", &S::rotation_deg, {-180, 180}, kRestart,
             "probe without a pose: turned about its axis"),
      number("array_from_tip_mm", &S::array_from_tip_mm, {0, 200}, kRestart,
             "the middle of the arrays behind the probe's tip"),
      integer("seed", &S::seed, {0, std::numeric_limits<std::int64_t>::max()}, kRestart,
              "of speckle and noise"),
  };
}

void check_ultrasound(const TomlTable& t, Scene& scene) {
  const UltrasoundSettings& s = scene.ultrasound;
  if (s.planes % 2 == 0) t.contradiction("planes", "is " + std::to_string(s.planes) + "; give 1, 3 or 5");
}

}  // namespace

SceneSection ultrasound_section() {
  return {"ultrasound", "The ultrasound image of the probe.",
          within<Scene>(
              ultrasound_keys(), [](auto& s) -> auto& { return s.ultrasound; }),
          check_ultrasound};
}

}  // namespace brachy
