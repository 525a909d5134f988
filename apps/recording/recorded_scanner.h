#pragma once

#include <filesystem>
#include <vector>

#include "net/wire/messages.h"

namespace brachy {

/// What was set at the ultrasound scanner during a recording, in order: each from its tick on, the first from the
/// recording's beginning. Empty where the daemon made no images or was recorded without (brachy record asks for them).
/// The images themselves are not recorded: `brachy us` makes them again. Throws UserError as read_recording.
std::vector<net::ScannerMessage> load_recorded_scanner(const std::filesystem::path& file);

}  // namespace brachy
