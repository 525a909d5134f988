#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "apps/import/case/imported_case.h"
#include "apps/import/dicom/dicom_file.h"

namespace brachy {

struct ImageSeries {
  std::string first_file;
  std::vector<std::unique_ptr<DicomFile>> images;

  std::string frame() const;  ///< UID of the first image's frame of reference; may be empty
};

/// By their Series Instance UID.
using SeriesByUid = std::map<std::string, ImageSeries>;

/// Reads the longest series in the structures' frame of reference that makes a volume as the case's, and says of the
/// others why they are left. Returns the series that was taken; null where there is none.
const ImageSeries* add_volume(const SeriesByUid& series, const std::string& frame, ImportedCase& imported);

/// Of ultrasound that meets the gland, the scale of its echoes. There is a volume, of this series.
void add_echoes(const ImageSeries& series, ImportedCase& imported);

}  // namespace brachy
