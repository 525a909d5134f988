// A label map in NIfTI; where the first byte is odd, what follows is compressed first.
#include "apps/import/labels/label_nifti.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"
#include "tests/fuzz/fuzzed_labels.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const bool is_packed = script.u8() % 2 != 0;
  std::string bytes = text_of(script.rest());
  if (is_packed) bytes = test::gzipped(bytes, 1);
  reads("map: ", [&] { check_labels(parse_label_nifti(bytes, "map", kMostFuzzedVoxels)); });
  return 0;
}

}  // namespace brachy::fuzz
