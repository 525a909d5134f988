#pragma once

#include <algorithm>
#include <string_view>

namespace brachy {

/// A command of brachy-study, the laboratory's program, that `brachy` lists and forwards to it.
struct StudyCommand {
  const char* name;
  const char* summary;  ///< for --help
};

inline constexpr StudyCommand kStudyCommands[] = {
    {"compare", "Run every model on every reference scene: errors, times, memory, as a table."},
    {"stability", "Sweep every method until it fails: where, how, and what theory says."},
    {"ticks", "Measure what a tick of every model shows of large motions, against neo-Hookean solutions."},
    {"lag", "Measure how far what ticks show is behind whole ticks, of one to seventeen needles."},
    {"zwidth", "Find the stiffest spring a device renders without ringing, against rate and delay."},
    {"deflection", "Fit the needle's bending to measured insertions, and predict others."}};

inline bool is_study_command(std::string_view name) {
  return std::ranges::any_of(kStudyCommands, [&](const StudyCommand& c) { return c.name == name; });
}

}  // namespace brachy
