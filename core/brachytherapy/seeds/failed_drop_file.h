#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/brachytherapy/seeds/seed_drop.h"

namespace brachy {

/// The first line of a session's file of seeds that were asked for and are not in the body: a row for each, in their
/// order. `planned` is −1 for a seed that is not in the plan, `why` the number of a DropRefusal, 7 for a lost seed;
/// mm, W.
inline constexpr std::string_view kFailedDropHeader = "tick,t_s,needle,planned,why,x,y,z";

/// One line without its end.
std::string failed_drop_row(const FailedDrop& drop);
/// Parses such a text; `name` stands for the file in errors. Throws UserError "name:line: what; fix".
std::vector<FailedDrop> parse_failed_drops(std::string_view text, const std::string& name);

}  // namespace brachy
