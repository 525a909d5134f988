#pragma once

#include <string>

namespace brachy {

/// Whether a command line is one of brachy-import: `import …`, or `export` with the option --dicom.
bool is_import_command(int argc, char** argv);

/// Replaces this process by `program`, which lies beside this one: same arguments, streams and process id. Does not
/// return. Errors: UserError where it is missing or cannot be run, with the path and `fix`.
[[noreturn]] void exec_sibling(const std::string& program, char** argv, const std::string& fix);

}  // namespace brachy
