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
  std::string frame;                            ///< UID of its frame of reference; may be empty
  std::vector<std::vector<Vec3>> contours;      ///< CLOSED_PLANAR and CLOSEDPLANAR_XOR; mm, RAS
  std::size_t other_contours = 0;               ///< points and open ones, which have no inside
  std::vector<Vec3> course;        ///< the points of those, in the file's order: a catheter; mm, RAS
  std::vector<std::string> notes;  ///< what was wrong and does not matter
  std::string fault;               ///< why it cannot be read, as an error's text; empty where it can
};

struct RtStructureSet {
  std::string frame;  ///< UID of the frame of reference of most contours; empty where the file has none
  std::vector<RtRoi> rois;
  std::vector<std::string> left;  ///< what is of no structure, one line each
};

/// Reads an RTSTRUCT. What is wrong with one structure is that structure's `fault`: its contours are not those of the
/// file then. Errors: UserError "FILE: tag: what; fix" where there is no structure. Limits: 20 million points.
RtStructureSet read_rt_structure(const DicomFile& file);

}  // namespace brachy
