#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace brachy {

/// The report {"quick": …, "simd": …, "rows": …} as text.
std::string report_text(bool quick, nlohmann::ordered_json rows);

/// Appends a name that is not among them yet.
void add_name(std::vector<std::string>& names, const std::string& name);

}  // namespace brachy
