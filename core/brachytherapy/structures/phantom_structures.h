#pragma once

#include "core/geometry/surface/surface_mesh.h"

namespace brachy {

/// The phantom's urethra at phantom_size() (core/geometry/tissue/phantom.h): a closed tube of 6 mm diameter from 3 mm
/// above the bladder neck to 3 mm below the apex, in the median plane x = 0, bent forwards at both ends as the
/// prostatic urethra is at the verumontanum. Inside the gland, at least 7 mm from its back and front, except where it
/// passes through base and apex. Closed, outward; mm, RAS. Not a patient's: sizes from anatomy textbooks.
SurfaceMesh phantom_urethra();

/// The phantom's rectum at phantom_size(): a closed straight cylinder along z, 27 mm wide and 75 mm long, its front
/// wall 4 mm behind the gland's back in the median plane. Solid: wall and contents. Closed, outward; mm, RAS.
SurfaceMesh phantom_rectum();

}  // namespace brachy
