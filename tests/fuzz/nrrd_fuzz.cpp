// An NRRD volume; the first byte chooses whether the rest is the file, or a header whose data are gzip of what follows
// its empty line, so that inputs reach the values behind the compression.
#include <cmath>

#include <zlib.h>

#include "core/geometry/volume/nrrd_file.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const bool is_packed = script.u8() % 2 != 0;
  std::string bytes = text_of(script.rest());
  if (const std::size_t end = bytes.find("\n\n"); is_packed && end != std::string::npos)
    bytes = bytes.substr(0, end + 2) + test::gzipped(bytes.substr(end + 2), 1);
  reads("volume: ", [&] {
    const NrrdVolume nrrd = parse_nrrd(bytes, "volume", {.max_values = std::size_t{1} << 22});
    const Volume& volume = nrrd.volume;
    EXPECT_EQ(volume.values().size(), volume.grid().count());
    EXPECT_LE(volume.values().size(), std::size_t{1} << 22);
    for (const float value : volume.values()) EXPECT_TRUE(std::isfinite(value));
    const Vec3 middle = volume.grid().position(Vec3::Zero());
    EXPECT_TRUE(std::isfinite(volume.at(middle)));
    EXPECT_TRUE(volume.contains(middle));
    EXPECT_LE(volume.coarsened(1).values().size(), volume.values().size());
  });
  return 0;
}

}  // namespace brachy::fuzz
