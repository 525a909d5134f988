#pragma once

#include <string>

namespace brachy {

/// What the guard does where landmarks would fold the field.
struct GuardSettings {
  /// flag: nothing, the certificate reports the fold; clamp: all landmarks are clamped to where the field is still
  /// injective; substep: injective sub-steps are composed, up to max_substeps, then clamped.
  std::string policy = "substep";
  int max_substeps = 8;

  bool operator==(const GuardSettings&) const = default;
};

}  // namespace brachy
