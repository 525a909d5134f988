// A label map or segmentation in NRRD; the first byte chooses, as in nrrd_fuzz. What is small becomes surfaces.
#include "core/geometry/label_map/label_nrrd.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"
#include "tests/fuzz/fuzzed_labels.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const bool is_packed = script.u8() % 2 != 0;
  std::string bytes = text_of(script.rest());
  if (const std::size_t end = bytes.find("\n\n"); is_packed && end != std::string::npos)
    bytes = bytes.substr(0, end + 2) + test::gzipped(bytes.substr(end + 2), 1);
  reads("map: ", [&] {
    check_labels(parse_label_nrrd(bytes, "map", {kMostFuzzedVoxels, std::size_t{1} << 20, 64}));
  });
  return 0;
}

}  // namespace brachy::fuzz
