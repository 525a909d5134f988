#pragma once

#include <string>

#include "apps/import/case/imported_case.h"

namespace brachy {

/// What was imported as one SVG: the transverse, sagittal and coronal plane through the gland's centroid, with the
/// image where there is one, the outlines of all structures that they cut, the seeds near them, letters for the
/// patient's sides (transverse seen from the feet, coronal from the front), a legend with roles and volumes, and the
/// warnings at the top. Nothing but names of structures is the patient's. The same case gives the same bytes.
std::string picture_svg(const ImportedCase& imported);

}  // namespace brachy
