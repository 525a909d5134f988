#pragma once

#include <map>
#include <string>

namespace brachy::bench {

/// Heap bytes of a simulator (its tissue and field included) and of one mesh state: what a point costs, and all of it
/// at some sizes. The condensed columns' memory grows with the points too, up to its limit (BlockField::Options);
/// between 500,000 points and a million it no longer does, so that slope is without it.
std::map<std::string, double> measure_memory();

}  // namespace brachy::bench
