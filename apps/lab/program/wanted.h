#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace brachy {

/// Whether `name` begins with one of `wanted`, or nothing is wanted.
bool is_wanted(const std::string& name, const std::vector<std::string>& wanted);

/// Errors: UserError where one of `wanted` is the beginning of none of `names`; `option` asked for it.
void check_wanted(const std::vector<std::string>& wanted, const std::vector<std::string>& names,
                  const std::string& option);

/// Keeps the items whose name_of(item) is wanted. Errors: as check_wanted.
template <class Item, class NameOf>
void keep_wanted(std::vector<Item>& items, NameOf name_of, const std::vector<std::string>& wanted,
                 const std::string& option) {
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const Item& item : items) names.push_back(name_of(item));
  check_wanted(wanted, names, option);
  std::erase_if(items, [&](const Item& item) { return !is_wanted(name_of(item), wanted); });
}

/// The name of a reference scene.
inline std::string folder_name(const std::filesystem::path& folder) {
  return folder.filename().string();
}

}  // namespace brachy
