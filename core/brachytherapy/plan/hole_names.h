#pragma once

#include <string>
#include <vector>

#include "core/base/toml_table.h"
#include "core/brachytherapy/plan/template_grid.h"

namespace brachy {

// How a plan's file names holes: a plan that is read has its template's own names.

/// The grid by the names of a file: its letters_from and half_steps, without which they are those of the wire.
TemplateGrid read_hole_names(TomlTable& t, const TemplateGrid& grid);
/// The lines that say the names of `grid`; "" for those of the wire.
std::string hole_names_toml(const TemplateGrid& grid);

/// The holes of needles or catheters, from one grid's names to the other's of the same holes.
template <class Planned>
void rename_holes(std::vector<Planned>& planned, const TemplateGrid& from, const TemplateGrid& to) {
  for (Planned& one : planned) one.hole = to.renamed(one.hole, from);
}

}  // namespace brachy
