#include "apps/lab/program/report_files.h"

#include <iostream>

#include "apps/command_line/output_file.h"

namespace brachy {

void write_report(const std::optional<std::filesystem::path>& json_file, const std::string& json,
                  const std::optional<std::filesystem::path>& markdown_file, const std::string& table) {
  if (json_file) write_text(*json_file, json);
  if (markdown_file) write_text(*markdown_file, table);
  std::cout << table;
}

}  // namespace brachy
