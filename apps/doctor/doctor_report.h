#pragma once

#include <string>

#include "apps/doctor/fitting.h"
#include "apps/doctor/machine.h"

namespace brachy {

/// For people: the answer as a sentence, what to write into the scene where it does not fit, and what was found.
std::string to_text(const Machine& machine, const Scene& scene, const Diagnosis& diagnosis);
/// One line. "fits": whether the scene does as it is; "take": what does instead, with the scene's keys.
std::string to_json(const Machine& machine, const Scene& scene, const Diagnosis& diagnosis);

}  // namespace brachy
