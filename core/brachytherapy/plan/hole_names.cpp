#include "core/brachytherapy/plan/hole_names.h"

namespace brachy {

TemplateGrid read_hole_names(TomlTable& t, const TemplateGrid& grid) {
  TemplateGrid named = grid.named_as_on_wire();
  t.text("letters_from", named.letters_from, {"left", "right"});
  t.flag("half_steps", named.half_steps);
  return named;
}

std::string hole_names_toml(const TemplateGrid& grid) {
  if (grid.is_named_as(grid.named_as_on_wire())) return "";
  return "letters_from = \"" + grid.letters_from +
         "\"  # of the patient: where column A is\nhalf_steps = " + (grid.half_steps ? "true" : "false") +
         "\n";
}

}  // namespace brachy
