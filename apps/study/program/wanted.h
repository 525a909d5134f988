#pragma once

#include <string>
#include <vector>

namespace brachy {

/// Whether `name` begins with one of `wanted`, or nothing is wanted.
bool is_wanted(const std::string& name, const std::vector<std::string>& wanted);

/// Errors: UserError where one of `wanted` is the beginning of none of `names`; `option` asked for it.
void check_wanted(const std::vector<std::string>& wanted, const std::vector<std::string>& names,
                  const std::string& option);

}  // namespace brachy
