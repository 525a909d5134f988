#pragma once

#include <filesystem>
#include <vector>

#include "core/structures/structure.h"

namespace brachy {

/// Writes each structure as NAME.vtp, its surface in mm, and structures.pvd, which names them all, into a folder that
/// is made where it is missing. Errors: UserError where that cannot be done.
void write_structures(const std::filesystem::path& folder, const std::vector<Structure>& structures);

}  // namespace brachy
