#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/slices/slice.h"

namespace brachy {

/// What a slice writes: `tool`, `slice`, `run`, in which slices that belong together agree, and the tool's own results.
/// The program's version and instruction set are added to `run`: with others the results would have other bits.
nlohmann::ordered_json slice_file(const std::string& tool, const Slice& slice, nlohmann::ordered_json run);

/// The files of all slices of one run, read and in the slices' order. Errors: UserError names the file that is none of
/// `tool`'s slices or of another run, and in what; slices that are there twice; those that are missing.
std::vector<nlohmann::ordered_json> read_slice_files(const std::vector<std::filesystem::path>& files,
                                                     const std::string& tool);

}  // namespace brachy
