#pragma once

#include <string>
#include <vector>

#include "apps/forces/force_log.h"

namespace brachy {

/// Which samples of one needle are on the way in and which on the way out, from its depth; a turn of less than
/// `least_mm` is ignored (tremor). One flag per sample: true = out.
std::vector<bool> on_the_way_out(const std::vector<ForceSample>& samples, double least_mm = 0.5);

/// Axial force with its parts at the tip and along the shaft, against depth and below against time, as SVG. `samples`:
/// of one needle.
std::string force_chart(const std::vector<ForceSample>& samples, const std::string& title);

}  // namespace brachy
