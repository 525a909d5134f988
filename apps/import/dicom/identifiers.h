#pragma once

#include <string>
#include <vector>

#include "apps/import/dicom/dicom_file.h"

namespace brachy {

struct Identifier {
  std::string tag;    ///< "Patient's Name (0010,0010)"
  std::string value;  ///< never written unless asked for
};

/// What identifies the patient or who treated them and stands at the top of the file: the attributes of the basic
/// de-identification profile (PS3.15, table E.1-1) that planning systems fill in.
std::vector<Identifier> identifiers_of(const DicomFile& file);

}  // namespace brachy
