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

/// The longest series in the frame of reference of the structures, else the longest of all; null where there is none.
/// Says of the others that they are `left`.
const ImageSeries* longest_series(const SeriesByUid& series, const std::string& frame,
                                  std::vector<std::string>& left);

/// Reads the images as the case's volume, and of ultrasound that meets the gland the scale of its echoes. Errors:
/// read_image_series'.
void add_volume(const ImageSeries& series, ImportedCase& imported);

}  // namespace brachy
