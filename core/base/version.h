#pragma once

#include <string>

namespace brachy {

/// The version of this library and of the programs built with it: "0.1.0". Clients and servers send it to their peer.
std::string version();

}  // namespace brachy
