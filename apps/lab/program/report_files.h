#pragma once

#include <algorithm>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

namespace brachy {

/// Writes JSON and table to the files that were asked for, and prints the table. Errors: UserError names what cannot be
/// written.
void write_report(const std::optional<std::filesystem::path>& json_file, const std::string& json,
                  const std::optional<std::filesystem::path>& markdown_file, const std::string& table);

/// Errors: std::runtime_error where every row has an error.
template <class Rows>
void check_results(const Rows& rows) {
  if (std::ranges::none_of(rows, [](const auto& row) { return row.error.empty(); }))
    throw std::runtime_error("no model had a result for any scene");
}

}  // namespace brachy
