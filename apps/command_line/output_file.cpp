#include "apps/command_line/output_file.h"

#include <fstream>

#include "core/base/error.h"

namespace brachy {

void write_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw UserError(file.string() + ": cannot be written; check the folder and the free space");
}

void check_folder_of(const std::optional<std::filesystem::path>& file) {
  if (!file) return;
  const auto folder = file->has_parent_path() ? file->parent_path() : std::filesystem::path(".");
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    throw UserError(file->string() + ": cannot be written; there is no folder " + folder.string());
}

}  // namespace brachy
