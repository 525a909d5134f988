#pragma once

#include <string>

namespace brachy {

/// Replaces this process by `program`, which lies beside this one: same arguments, streams and process id. Does not
/// return. Errors: UserError where it is missing or cannot be run: "`what` needs" its path, and `fix`.
[[noreturn]] void exec_sibling(const std::string& program, const std::string& what, char** argv,
                               const std::string& fix);

}  // namespace brachy
