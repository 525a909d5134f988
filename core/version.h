#pragma once

#include <string>

namespace brachy {

/// Of this library and of the programs that are built with it: "0.1.0". What talks over the wire shows it to its peer.
std::string version();

}  // namespace brachy
