#pragma once

#include <string>

#include "apps/import/case/imported_case.h"

namespace brachy {

/// Gives the structures their roles: options.gland and options.roles name structures as the file or the scene does,
/// others have those of their names (role_of_name). The gland comes first and is called "prostate" in the scene.
/// There is a structure. Errors: UserError with the candidates, where nothing decides between them, or no name is the
/// gland's and there are several structures.
void assign_roles(const ImportOptions& options, ImportedCase& imported);

/// The organ that the name of a file tells, "prostate" for "DOE_prostate.nii.gz", "hip_left" for that: its words as far
/// as they are words for parts of the body. Empty: it tells none.
std::string organ_in_file_name(const std::string& file);

}  // namespace brachy
