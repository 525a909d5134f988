#pragma once

namespace brachy {

/// Whether a command line is one of brachy-import: `import …`, or `export` with the option --dicom.
bool is_import_command(int argc, char** argv);

/// Replaces this process by brachy-import, which lies beside this program: same arguments, streams and process id.
/// Does not return. Errors: UserError where brachy-import is missing or cannot be run, with the path and the fix.
[[noreturn]] void exec_import(char** argv);

}  // namespace brachy
