#pragma once

#include <string>

namespace brachy {

/// What is done where landmarks would fold the field.
struct GuardSettings {
  /// flag: the plain field, and what the certificate says of it; clamp: all landmarks are held where the field is still
  /// injective; substep: injective sub-steps are composed, up to max_substeps, beyond them as clamp.
  std::string policy = "substep";
  int max_substeps = 8;

  bool operator==(const GuardSettings&) const = default;
};

}  // namespace brachy
