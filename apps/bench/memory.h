#pragma once

#include <map>
#include <string>

namespace brachy::bench {

/// Heap bytes a point of a simulator (its tissue and field included) and of one mesh state costs: the slope between
/// 100,000 and a million points, and all of it for the default scene.
std::map<std::string, double> measure_memory();

}  // namespace brachy::bench
