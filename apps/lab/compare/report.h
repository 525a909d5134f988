#pragma once

#include <string>
#include <vector>

#include "apps/lab/compare/measure.h"

namespace brachy {

/// All rows as JSON: `rows` with the fields of CompareRow, lengths in mm, times in ms; `error` and no figures where a
/// model has no result.
std::string to_json(const std::vector<CompareRow>& rows, bool quick);

/// A Markdown table of the listed models: mean errors for each group of scenes, means of the rest over the scenes that
/// count.
std::string to_markdown(const std::vector<CompareRow>& rows);

}  // namespace brachy
