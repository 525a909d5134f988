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

void check_is_new(const std::optional<std::filesystem::path>& file, bool force) {
  std::error_code ignored;
  if (file && !force && std::filesystem::is_regular_file(*file, ignored))
    throw UserError(file->string() + ": exists already; give another name, or --force to overwrite it");
}

void check_is_no_input(const std::filesystem::path& out,
                       const std::vector<std::optional<std::filesystem::path>>& inputs) {
  for (const auto& input : inputs) {
    std::error_code ignored;
    if (input && std::filesystem::equivalent(out, *input, ignored))
      throw UserError(out.string() + ": is an input; give the output another name");
  }
}

}  // namespace brachy
