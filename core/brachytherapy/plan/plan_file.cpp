#include "core/brachytherapy/plan/plan_file.h"

#include <fstream>
#include <sstream>

#include "core/base/denied_folder.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"

namespace brachy {
namespace {

constexpr std::uintmax_t kMaxPlanBytes = 1 << 20;

std::string read_file(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
  refuse_denied_folder(file);
  if (!std::filesystem::is_regular_file(file, error))
    throw UserError(name + ": no such plan; `brachy plan --generate --out PLAN.toml` makes one");
  if (std::filesystem::file_size(file, error) > kMaxPlanBytes)
    throw UserError(name + ": larger than 1 MiB; a plan is a page of TOML or CSV");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw UserError(name + ": cannot be read; check its permissions");
  return text.str();
}

}  // namespace

Plan load_plan(const std::filesystem::path& file, const TemplateGrid& grid, double needle_length_mm) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return reading(file, FileKind::kPlan, [&] {
    if (extension != ".toml" && extension != ".csv")
      throw UserError(file.string() + ": unknown plan format; the name must end in .toml or .csv");
    const std::string text = read_file(file);
    return (extension == ".csv" ? parse_plan_csv : parse_plan_toml)(text, file.string(), grid,
                                                                    needle_length_mm);
  });
}

}  // namespace brachy
