#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace brachy {

/// What a structure is to plans, dose, checks and viewers, whatever its file calls it.
enum class StructureRole : std::uint8_t {
  kOther,  ///< also what only helps planning: rings, margins, isodoses, spacers
  kGland,
  kTarget,  ///< CTV, PTV, GTV: no organ, but the gland where a file has no other
  kUrethra,
  kRectum,
  kBladder,
  kPubicArch,
  kSeminalVesicles,
  kPenileBulb,
  kFemoralHead,
  kBowel,
  kBody
};

/// The role as scenes write it: "prostate", "target", "urethra", "rectum", "bladder", "pubic_arch", …, "other".
const char* role_word(StructureRole role);
std::optional<StructureRole> role_of_word(std::string_view word);
/// All words, of "other" first.
std::vector<std::string> role_words();

/// At most one structure has it, and is called by role_word in plans, dose reports and viewers.
bool is_unique(StructureRole role);

/// What a name says.
struct NamedRole {
  /// Between names for one role the least counts: the name itself; with words beside it ("Rectum_Wall", "Prostate2");
  /// only a part, or more than the organ ("Bladder_Neck", "Prostate_L", "Prostate+SV"). Of targets: CTV_Prostate, CTV,
  /// and so for target, PTV, GTV.
  enum Fit : std::uint8_t { kExact, kContained, kPart };
  StructureRole role = StructureRole::kOther;
  std::uint8_t fit = kExact;

  bool operator==(const NamedRole&) const = default;
};

/// By the table of names in structure_names.cpp: those of AAPM TG-263 (Mayo et al., Int. J. Radiat. Oncol. Biol. Phys.
/// 100 (2018) 1057) and what clinics write in twenty languages, whatever their case, separators, digits and accents
/// (name_words). Exact names come before contained ones. Words of targets and of planning aids (ring, margin,
/// expansion, dose, avoidance, spacer, …) decide: such a name is no organ, whatever else it contains.
NamedRole role_of_name(std::string_view name);

/// The names whose role is `role` and that fit best, by their index: none, one, or several between which nothing
/// decides. For the gland, targets where there is no gland.
std::vector<std::size_t> best_named(const std::vector<std::string>& names, StructureRole role);

/// The patient's side that a name says: "Femur_Head_L", "Hüftkopf links", "testa femorale dx".
enum class BodySide : std::uint8_t { kNone, kLeft, kRight };
BodySide side_of_name(std::string_view name);

}  // namespace brachy
