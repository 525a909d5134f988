#pragma once

#include <cstdint>
#include <string>

namespace brachy {

/// A transrectal ultrasound scanner: array, beam, and what its console sets. Lengths in mm. Typical of a biplane
/// endorectal probe for brachytherapy at 6 to 7 MHz; levels in dB are against the mean echo of the gland's speckle.
struct UltrasoundSettings {
  bool on = true;                    ///< the daemon makes images for clients that ask for them
  double rate_hz = 30;               ///< of its images
  std::string array = "transverse";  ///< transverse, sagittal or end_fire (ImagePlane)
  double frequency_mhz = 6.5;        ///< of the pulse's middle
  double pulse_cycles = 2.5;         ///< the axial resolution is half of that many wavelengths
  double fov_deg = 130;              ///< of the sector of a transverse or end_fire array
  double length_mm = 60;             ///< of the sagittal array
  double depth_mm = 60;              ///< from the probe's surface
  double aperture_mm = 10;           ///< active, of the focused beam
  double focus_mm = 30;              ///< of the transmitted beam
  double elevation_mm = 3;           ///< thickness of the slice, full width at half maximum
  int planes = 3;                    ///< that the slice is summed of: 1, 3 or 5
  int lines = 512;                   ///< of a scan
  int width_px = 512, height_px = 512;

  double gain_db = 0;
  /// Time gain compensation beyond what soft tissue attenuates there and back; minus that: none at all.
  double tgc_extra_db_per_cm = 0;
  double dynamic_range_db = 60;
  double noise_db = -62;  ///< of the receiver, at the probe's surface

  double attenuation_db_per_cm_mhz = 0.5;  ///< of soft tissue, one way
  double needle_echo_db = 32, seed_echo_db = 22;
  double spacer_echo_db = 10;  ///< of a spacer across the beam, between two seeds of one train
  double shadow_db = 8;        ///< of a seed or needle across the whole slice, there and back
  double coupling = 1;         ///< share of the probe's surface that has contact (gel); elsewhere is air
  bool surroundings =
      true;  ///< bladder, pubic arch, muscle and calcifications around and in the phantom's gland
  /// An NRRD of the patient's echoes at rest, in place of made-up tissue; relative to the scene's folder; "": none.
  std::string volume;
  double volume_db_per_value = 60.0 / 255;  ///< of its values: a B-mode image of 8 bits over 60 dB

  /// Where the probe is while it has no pose of its own: parallel to z behind the gland, rectal wall between, the
  /// middle of its arrays this far from the gland's middle, turned by so much about its axis.
  double offset_mm = 0, rotation_deg = 0;
  double array_from_tip_mm = 40;  ///< the middle of the arrays
  std::uint64_t seed = 1;         ///< of speckle and noise

  bool operator==(const UltrasoundSettings&) const = default;
};

}  // namespace brachy
