#pragma once

#include <cstddef>
#include <string>

namespace brachy {

/// The needle's body. Lengths in mm.
struct NeedleSettings {
  /// 18 G, mm: the diameter that TissueContact's forces refer to
  static constexpr double kReferenceDiameter = 1.27;
  static constexpr std::size_t kMaxCount = 24;

  double length_mm = 200;  ///< hub to tip; 18 G brachytherapy needle (core/DESIGN.md, section 6)
  double diameter_mm = kReferenceDiameter;
  std::size_t count = 1;  ///< needles that may be in the scene at once, all of this body

  static constexpr double kRigidGpa = 1e9;  ///< from this modulus on a needle is rigid

  bool flexible = false;            ///< bends, as a beam (core/needle/needle_bend.h); false: rigid
  double youngs_modulus_gpa = 200;  ///< steel
  bool bends() const { return flexible && youngs_modulus_gpa < kRigidGpa; }
  double inner_diameter_mm = 0;  ///< 0: solid, as with its stylet in
  double hand_nmm_per_deg = 0;   ///< moment that turns the hand by 1°; 0: it holds the hub fast
  /// The bevel's force across the tip as it cuts, over the cutting force; 0: a symmetric tip
  double bevel_force_share = 0;
  std::size_t locking_count = 0;  ///< needles that lock the gland: the last so many of them
  double bevel_deg = 0;           ///< where it pushes the tip: about the shaft, from the pose's +x towards +y
  static constexpr const char* kGuideInHand = "hand";
  /// What holds the shaft across where it passes the plane of the holes: "template", a hole fixed in the world; "hand",
  /// one that goes with the hand; "none"
  std::string guide_at = "none";

  bool operator==(const NeedleSettings&) const = default;
};

/// Contact forces of an 18 G needle in one tissue; others are in proportion to their diameter. config/prostate.toml
/// cites the sources.
struct TissueContact {
  double puncture_force_n = 5.6;  ///< at which the tissue's capsule is punctured; 0: no capsule
  double capsule_n_per_mm = 0.3;  ///< a₁: an indentation δ of the capsule takes at most a₁δ + a₂δ², N
  double capsule_n_per_mm2 = 0.06;  ///< a₂
  double cutting_force_n = 3;       ///< at which the tip cuts
  double friction_n_per_mm = 0.02;  ///< along the shaft, for each mm in the tissue

  double indentation_force_n(double indentation_mm) const {
    return indentation_mm * indentation_stiffness_n_per_mm(indentation_mm);
  }
  /// That force over the indentation (secant).
  double indentation_stiffness_n_per_mm(double indentation_mm) const {
    return capsule_n_per_mm + capsule_n_per_mm2 * indentation_mm;
  }

  bool operator==(const TissueContact&) const = default;
};

/// How a needle's landmarks are placed. Lengths in mm.
struct ContactSettings {
  /// Core radius over which a contact's or a tip's force is spread on `elastic` and `fem`. 0: a contact's is the one
  /// that makes the tissue there as stiff as the force law a₁δ + a₂δ² (core/DESIGN.md, section 5), so that it follows a
  /// pressing tip all the way; an inserted tip's is kInsertedTipCore. Another is at least √(F/32μ) for the largest
  /// force F that occurs, 5.4 mm for 5.6 N at 6 kPa, or the tissue folds there.
  double tip_core_mm = 0;
  static constexpr double kInsertedTipCore = 12;
  /// An inserted tip's. On the models that know no forces a lone landmark is as stiff as an elastic one of this core
  /// (core/elasticity/landmark_stiffness.h).
  double inserted_tip_core_mm() const { return tip_core_mm > 0 ? tip_core_mm : kInsertedTipCore; }
  double surface_slip_mm = 2;       ///< on the intact capsule the contact point slides beyond this drag
  double landmark_spacing_mm = 5;   ///< between shaft landmarks along the cut path
  double leave_path_mm = 2;         ///< a tip this far beside an old cut cuts a new one
  double max_displacement_mm = 15;  ///< a landmark's displacement is limited to this and flagged
  /// a tip that moves farther in a tick has jumped, and its contact is reinitialized
  double max_jump_mm = 10;
  /// Share of a reaction that relaxes while the tissue is held, with the time constant relaxation_s: one Prony term. A
  /// needle that stops keeps half its force after some seconds (0.50 → 0.25 … 0.28 N; Okamura et al. 2004, digitised).
  double relaxation_share = 0;
  double relaxation_s = 2;
  /// Force along its shaft that a locking needle's barbs hold besides friction; an assumption
  double locking_force_n = 6;
  /// Stiffness with which bone, a structure named pubic_arch, pushes back a hand that goes on; far beyond a device's
  double bone_n_per_mm = 20;
  int max_landmarks = 41;  ///< of a needle, tip and shaft; spacing × (max − 1) must cover it

  bool operator==(const ContactSettings&) const = default;
};

}  // namespace brachy
