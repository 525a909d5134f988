#pragma once

#include <string>

#include "apps/score/explanation/explanation.h"
#include "core/brachytherapy/plan/plan.h"

namespace brachy {

/// "depth", "swapped": for programs.
const char* name_of(Cause::Kind kind);

/// A cause in an instructor's words, without what it cost. `seeds_outside`: how many of its seeds rest outside the
/// gland because of it. No needle is named that is not a member: a hole that is another's is told by its direction.
std::string text_of(const Cause& cause, const Explanation& explanation, const Deviations& deviations,
                    const Plan& plan, const TemplateGrid& grid, std::size_t seeds_outside);

/// "3 seeds", "1 seed".
std::string counted(std::size_t count, const char* what);
/// "D4, G9".
std::string joined(const std::vector<std::string>& names);

}  // namespace brachy
