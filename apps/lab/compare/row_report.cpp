#include "apps/lab/compare/row_report.h"

#include <algorithm>

#include "core/base/simd/simd_target.h"

namespace brachy {

std::string report_text(bool quick, nlohmann::ordered_json rows) {
  const nlohmann::ordered_json report = {
      {"quick", quick}, {"simd", to_string(best_simd_target())}, {"rows", std::move(rows)}};
  return report.dump(1) + "\n";
}

void add_name(std::vector<std::string>& names, const std::string& name) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

}  // namespace brachy
