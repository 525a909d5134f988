#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/lab/slices/slice.h"
#include "apps/lab/stability/sweeps.h"

namespace brachy {

/// Those of `sweeps` that belong to a slice, in their order: the longest first, each to the slice with the least to do.
/// Of more slices than sweeps some have none.
std::vector<Sweep> sweeps_of(const Slice& slice, const std::vector<Sweep>& sweeps);

/// The file of a slice: for each of its sweeps, whose reports follow each other in `parts`, what it added. `all`: the
/// run's sweeps; `scene`: the scene file's text, empty where there is none.
std::string to_json(const Slice& slice, const std::vector<Sweep>& all, const std::string& scene, bool quick,
                    const std::vector<Sweep>& swept, const std::vector<StabilityReport>& parts);

/// The report of the run that was sliced, from the slices' files. Errors: UserError, as read_slice_files.
StabilityReport merge_stability(const std::vector<std::filesystem::path>& files);

}  // namespace brachy
