#pragma once

#include <string>
#include <vector>

#include "core/brachytherapy/structures/structure_role.h"
#include "core/scene/scene.h"

namespace brachy {

/// The role of each of scene.structures: structure.role, or by its name (role_of_name). Of several names that stand for
/// one unique role the best has it; a name that only contains the gland's is not the gland. Errors: UserError with the
/// candidates and their places where two fit equally well, or two have one role by their keys.
std::vector<StructureRole> structure_roles(const Scene& scene);

/// By what each of scene.structures is known to plans, dose reports, goals and viewers: role_word where its role is
/// unique, else its name. Once each. Errors: as structure_roles.
std::vector<std::string> structure_names(const Scene& scene);

}  // namespace brachy
