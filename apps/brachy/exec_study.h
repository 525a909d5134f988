#pragma once

namespace brachy {

/// Replaces this process by brachy-study, which lies beside this program: same arguments, streams and process id.
/// Does not return. Errors: UserError where brachy-study is missing or cannot be run, with the path and the fix.
[[noreturn]] void exec_study(char** argv);

}  // namespace brachy
