#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/import/dicom/dicom_file.h"

namespace brachy {

/// A region of interest of an RTSTRUCT.
struct RtRoi {
  int number = 0;
  std::string name;
  std::optional<std::array<double, 3>> colour;  ///< red, green, blue, 0 … 1
  std::vector<std::vector<Vec3>> contours;      ///< CLOSED_PLANAR and CLOSEDPLANAR_XOR; mm, RAS
  std::size_t other_contours = 0;               ///< points and open ones, which have no inside
};

struct RtStructureSet {
  std::string frame;  ///< UID of the frame of reference; empty where the file has none
  std::vector<RtRoi> rois;
};

/// Reads an RTSTRUCT. Errors: UserError "FILE: tag: what; fix". Limits: 20 million points.
RtStructureSet read_rt_structure(const DicomFile& file);

}  // namespace brachy
