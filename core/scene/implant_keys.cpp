#include "core/scene/implant_keys.h"

#include <algorithm>
#include <string_view>

#include "core/dose/source.h"
#include "core/scene/scene.h"
#include "core/scene/toml_table.h"

namespace brachy {
namespace {

void read_template(TomlTable t, TemplateGrid& s) {
  t.integer("columns", s.columns, 1, TemplateGrid::kMaxColumns);
  t.integer("rows", s.rows, 1, TemplateGrid::kMaxRows);
  t.number("spacing_mm", s.spacing_mm, 1, 50);
  t.numbers("origin_mm", s.origin_mm, -1e5, 1e5);
  t.refuse_unknown();
}

void read_seeds(TomlTable t, const std::string& plan_file, SeedSettings& s) {
  t.text("applicator", s.applicator, {"single", "train"});
  std::string source = "6711";
  t.text("source", source, {"6711", "200"});
  s.source = *find_source(source);
  t.number("air_kerma_strength_u", s.air_kerma_strength_u, 1e-3, 100);
  t.integer("max_count", s.max_count, 1, SeedSettings::kMaxCount);
  t.refuse_unknown();
  if (s.applicator == "train" && plan_file.empty())
    t.contradiction("applicator",
                    "is \"train\", and trains are a plan's; give plan.file = \"PLAN.toml\" or make it "
                    "\"single\"");
}

void read_dose(TomlTable t, DoseSettings& s) {
  t.number("prescription_gy", s.prescription_gy, 1, 1000);
  t.number("spacing_mm", s.spacing_mm, 0.25, 10);
  t.number("margin_mm", s.margin_mm, 0, 50);
  t.refuse_unknown();
}

// Names of structures become names of files.
bool is_plain(std::string_view name) {
  return !name.empty() && name.size() <= 32 && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
}

void read_structure(TomlTable t, const std::vector<StructureSettings>& before, StructureSettings& s) {
  s.place = t.place();
  t.text("name", s.name);
  t.text("file", s.file);
  t.refuse_unknown();
  const char* kWhat = "a [[structure]] has a name and the file of its closed surface";
  if (!t.has("name")) t.missing("name", kWhat);
  if (!t.has("file")) t.missing("file", kWhat);
  if (!is_plain(s.name))
    t.contradiction("name", "is \"" + s.name + "\"; name it with 1 to 32 letters, digits, _ and -");
  if (s.name == "prostate")
    t.contradiction("name", "is \"prostate\", which is the tissue's own surface; give that with tissue.mesh");
  const auto same = std::ranges::find(before, s.name, &StructureSettings::name);
  if (same != before.end())
    t.contradiction("name",
                    "is \"" + s.name + "\" as that at " + same->place + "; call one of them otherwise");
}

}  // namespace

void read_implant(TomlTable& top, Scene& scene) {
  read_template(top.table("template"), scene.template_grid);
  TomlTable plan = top.table("plan");
  plan.text("file", scene.plan_file);
  plan.refuse_unknown();
  read_seeds(top.table("seeds"), scene.plan_file, scene.seeds);
  read_dose(top.table("dose"), scene.dose);
  for (TomlTable& table : top.tables("structure")) {
    StructureSettings structure;
    read_structure(table, scene.structures, structure);
    scene.structures.push_back(std::move(structure));
  }
}

}  // namespace brachy
