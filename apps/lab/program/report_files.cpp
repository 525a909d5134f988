#include "apps/lab/program/report_files.h"

#include <iostream>

#include "apps/command_line/output_file.h"

namespace brachy {

void write_report(const std::optional<std::filesystem::path>& json_file, const std::string& json,
                  const std::optional<std::filesystem::path>& markdown_file, const std::string& table) {
  // Files that exist were refused before the run (study_line.cpp).
  if (json_file) write_text(*json_file, json, true);
  if (markdown_file) write_text(*markdown_file, table, true);
  std::cout << table;
}

}  // namespace brachy
