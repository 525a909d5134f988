#pragma once

namespace brachy {

/// The needle's body. Lengths in mm.
struct NeedleSettings {
  double length_mm = 200;     ///< hub to tip; 18 G brachytherapy needle (DESIGN §6)
  double diameter_mm = 1.27;  ///< 18 G

  bool operator==(const NeedleSettings&) const = default;
};

/// How needle and tissue meet while reactions are not yet forces: stick and slip are bounds on displacement, mm.
struct ContactSettings {
  double puncture_indentation_mm = 3.0;   ///< the capsule gives way at this push along the needle
  double cutting_displacement_mm = 1.5;   ///< tissue at the tip is carried this far before it is cut
  double friction_displacement_mm = 1.0;  ///< tissue along the shaft is carried this far before it slips
  double surface_slip_mm = 2.0;           ///< on the intact capsule the contact point slides beyond this drag
  double landmark_spacing_mm = 5.0;       ///< between shaft landmarks along the cut path
  double max_displacement_mm = 10.0;      ///< a landmark's displacement is held at this and flagged
  double max_jump_mm = 10.0;  ///< a tip that moves farther in a tick has jumped, and is seated anew
  int max_landmarks = 41;     ///< tip and shaft; spacing × (max − 1) must cover the needle

  bool operator==(const ContactSettings&) const = default;
};

}  // namespace brachy
