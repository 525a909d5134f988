// A label map in MetaImage; where the first byte is odd, what follows the header is compressed first.
#include "apps/import/labels/meta_image.h"
#include "core/geometry/label_map/label_nrrd.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"
#include "tests/fuzz/fuzzed_labels.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const bool is_packed = script.u8() % 2 != 0;
  std::string bytes = text_of(script.rest());
  constexpr std::string_view kEnd = "LOCAL\n";
  if (const std::size_t end = bytes.find(kEnd); is_packed && end != std::string::npos)
    bytes = bytes.substr(0, end + kEnd.size()) + test::gzipped(bytes.substr(end + kEnd.size()), 1);
  reads("map: ", [&] {
    const NrrdHeader header = parse_meta_header(bytes, "map", {kMostFuzzedVoxels, std::size_t{1} << 20, 1});
    check_labels(read_label_volume(header, bytes, "map"));
  });
  return 0;
}

}  // namespace brachy::fuzz
