#pragma once

#include "apps/import/dicom/dicom_file.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

/// Reads the input as a DICOM file, behind a preamble and "DICM", and calls `read` with it.
inline bool reads_dicom(const std::uint8_t* data, std::size_t size,
                        const std::function<void(const DicomFile&)>& read) {
  Script script(data, size);
  const std::string bytes = std::string(128, '\0') + "DICM" + text_of(script.rest());
  return reads("file: ", [&] { read(DicomFile(bytes, "file")); });
}

}  // namespace brachy::fuzz
