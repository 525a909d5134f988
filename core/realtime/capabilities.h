#pragma once

namespace brachy {

/// Drops every capability of the calling thread (capabilities(7)) permanently: its effective, permitted and
/// inheritable sets are empty afterwards, and no program that it starts gets any. Root is then an ordinary
/// user that owns root's files. Throws std::system_error where the kernel refuses.
/// Threads: capabilities are per thread; threads created later by the caller start with none.
void drop_capabilities();

}  // namespace brachy
