#include "apps/lab/program/wanted.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.h"

namespace brachy {

bool is_wanted(const std::string& name, const std::vector<std::string>& wanted) {
  return wanted.empty() || std::ranges::any_of(wanted, [&](const auto& w) { return name.starts_with(w); });
}

void check_wanted(const std::vector<std::string>& wanted, const std::vector<std::string>& names,
                  const std::string& option) {
  for (const std::string& w : wanted) {
    if (std::ranges::any_of(names, [&](const auto& name) { return name.starts_with(w); })) continue;
    std::string all;
    for (const auto& name : names) all.append(all.empty() ? "" : ", ").append(name);
    throw UserError(fmt::format("{}: there is no {}; choose from {}", option, w, all));
  }
}

}  // namespace brachy
