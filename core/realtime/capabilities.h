#pragma once

namespace brachy {

/// Gives up every capability of the calling thread (capabilities(7)) for good: its effective, permitted and inheritable sets
/// are empty afterwards, and no program that it starts gets any. Root is a user like others then, who owns root's files.
/// Throws std::system_error where the kernel refuses.
///
/// Threads: each has its own; those that it creates later begin with none.
void drop_capabilities();

}  // namespace brachy
