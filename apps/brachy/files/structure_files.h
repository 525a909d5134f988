#pragma once

#include <filesystem>
#include <vector>

#include "core/brachytherapy/structures/structure.h"

namespace brachy {

/// Writes each structure as NAME.vtp, its surface in mm, and structures.pvd, which lists them all, into a directory
/// that is created if missing. Errors: UserError where that cannot be done.
void write_structures(const std::filesystem::path& folder, const std::vector<Structure>& structures,
                      bool force = false);

}  // namespace brachy
