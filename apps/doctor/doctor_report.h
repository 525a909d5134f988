#pragma once

#include <string>

#include "apps/doctor/fitting.h"
#include "apps/doctor/machine.h"

namespace brachy {

/// For the terminal: the answer as a sentence, the keys to change if the scene does not fit, and the measurements.
std::string to_text(const Machine& machine, const Scene& scene, const Diagnosis& diagnosis);
/// One line. "fits": whether the scene fits as it is; "take": the recommended model and rate, with the
/// scene's keys.
std::string to_json(const Machine& machine, const Scene& scene, const Diagnosis& diagnosis);

}  // namespace brachy
