#include "core/plan/plan_file.h"

#include <array>
#include <charconv>
#include <fstream>
#include <sstream>

#include "core/dose/source.h"
#include "core/error.h"
#include "core/plan/plan_check.h"
#include "core/scene/toml_table.h"

namespace brachy {
namespace {

constexpr std::uintmax_t kMaxPlanBytes = 1 << 20;

std::string read_file(const std::filesystem::path& file) {
  const std::string name = file.string();
  std::error_code error;
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

void require(const TomlTable& t, std::initializer_list<const char*> keys, const char* what) {
  for (const char* key : keys)
    if (!t.has(key)) t.missing(key, what);
}

void read_needle(TomlTable t, Plan& plan, const PlanLimits& limits) {
  PlanNeedle& needle = plan.needles.emplace_back();
  t.text("hole", needle.hole);
  t.number("retraction_mm", needle.retraction_mm, 0, PlanLimits::kMostRetractionMm);
  t.text("train", needle.train);
  t.refuse_unknown();
  require(t, {"hole", "train"}, "a [[needle]] has a hole and a train, such as \"D4\" and \"s-s--s\"");
  check_needle(plan, plan.needles.size() - 1, limits,
               [&](const char* key, const std::string& what) { t.contradiction(key, what); });
}

// The shortest text that reads back as the same bits; TOML takes it too.
std::string exact(double v) {
  std::array<char, 32> buffer;
  return {buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), v).ptr};
}

// For both TOML and CSV what stands between the quotes.
std::string escaped(const std::string& text, const char* special, char escape) {
  std::string out;
  for (const char c : text) {
    if (std::string_view(special).find(c) != std::string_view::npos) out += escape;
    out += c;
  }
  return out;
}

}  // namespace

Plan parse_plan_toml(std::string_view text, const std::string& name, const TemplateGrid& grid,
                     double needle_length_mm) {
  toml::table root;
  try {
    root = toml::parse(text, name);
  } catch (const toml::parse_error& e) {
    throw UserError(name + ":" + std::to_string(e.source().begin.line) +
                    ": not valid TOML: " + std::string(e.description()));
  }
  TomlTable t(&root, "", name);
  Plan plan;
  std::string source = "6711";
  t.text("name", plan.name);
  t.text("source", source, {"6711", "200"});
  t.number("air_kerma_strength_u", plan.air_kerma_strength_u, PlanLimits::kLeastStrengthU,
           PlanLimits::kMostStrengthU);
  t.number("prescription_gy", plan.prescription_gy, PlanLimits::kLeastPrescriptionGy,
           PlanLimits::kMostPrescriptionGy);
  t.number("base_plane_mm", plan.base_plane_mm, PlanLimits::kLeastBasePlaneMm, PlanLimits::kMostBasePlaneMm);
  std::vector<TomlTable> needles = t.tables("needle");
  t.refuse_unknown();
  plan.source = *find_source(source);
  check_name(plan.name, [&](const char* key, const std::string& what) { t.contradiction(key, what); });
  require(t, {"source", "air_kerma_strength_u", "prescription_gy", "base_plane_mm"},
          "a plan says which seeds, how strong, for which dose and how deep; `brachy plan --generate` writes "
          "one");
  require(t, {"needle"}, "a plan has at least one [[needle]]");
  for (TomlTable& needle : needles) read_needle(needle, plan, {grid, needle_length_mm});
  return plan;
}

Plan load_plan(const std::filesystem::path& file, const TemplateGrid& grid, double needle_length_mm) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension != ".toml" && extension != ".csv")
    throw UserError(file.string() + ": a plan is a .toml or a .csv; name it so");
  const std::string text = read_file(file);
  return (extension == ".csv" ? parse_plan_csv : parse_plan_toml)(text, file.string(), grid,
                                                                  needle_length_mm);
}

std::optional<Plan> load_plan(const Scene& scene) {
  if (scene.plan_file.empty()) return {};
  const auto file = scene.resolve(scene.plan_file);
  Plan plan = load_plan(file, scene.template_grid, scene.needle.length_mm);
  const std::size_t most = static_cast<std::size_t>(scene.seeds.max_count);
  if (plan.seed_count() > most)
    throw UserError(file.string() + ": " + std::to_string(plan.seed_count()) +
                    " seeds, and the scene takes " + std::to_string(most) + "; raise seeds.max_count");
  return plan;
}

std::string to_toml(const Plan& plan) {
  std::string out = "# Needles through a template and the seeds they leave; mm, U, Gy.\n";
  out += "name = \"" + escaped(plan.name, "\"\\", '\\') + "\"\n";
  out += "source = \"" + std::string(to_string(plan.source)) + "\"\n";
  out += "air_kerma_strength_u = " + exact(plan.air_kerma_strength_u) + "  # of each seed\n";
  out += "prescription_gy = " + exact(plan.prescription_gy) + "\n";
  out += "base_plane_mm = " + exact(plan.base_plane_mm) + "  # from the template's plane along the needles\n";
  out +=
      "# retraction_mm: how far short of the base plane the tip stops. train: from the tip backwards, s a "
      "seed of\n";
  out += "# 4.5 mm, - a spacer of 5.5 mm.\n";
  for (const PlanNeedle& needle : plan.needles)
    out += "\n[[needle]]\nhole = \"" + needle.hole + "\"\nretraction_mm = " + exact(needle.retraction_mm) +
           "\ntrain = \"" + needle.train + "\"\n";
  return out;
}

std::string to_csv(const Plan& plan) {
  const std::string of_plan = exact(plan.base_plane_mm) + "," + std::string(to_string(plan.source)) + "," +
                              exact(plan.air_kerma_strength_u) + "," + exact(plan.prescription_gy) + ",\"" +
                              escaped(plan.name, "\"", '"') + "\"\n";
  std::string out = std::string(kPlanCsvHeader) + "\n";
  for (const PlanNeedle& needle : plan.needles)
    out += needle.hole + "," + exact(needle.retraction_mm) + "," + needle.train + "," + of_plan;
  return out;
}

}  // namespace brachy
