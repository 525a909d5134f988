#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/lab/slices/slice.h"

namespace brachy {

/// The file of a slice: `tool`, `slice`, `run`, which is equal in all slices of a run, and the tool's results. The
/// program's version and instruction set are added to `run`, because results depend on them.
nlohmann::ordered_json slice_file(const std::string& tool, const Slice& slice, nlohmann::ordered_json run);

/// The files of all slices of one run, in the slices' order. Errors: UserError names a file that is not a slice of
/// `tool`, or of another run and how it differs; duplicate slices; missing slices.
std::vector<nlohmann::ordered_json> read_slice_files(const std::vector<std::filesystem::path>& files,
                                                     const std::string& tool);

}  // namespace brachy
