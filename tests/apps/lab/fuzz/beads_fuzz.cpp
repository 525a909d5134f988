// The CSV file of measured beads.
#include "apps/lab/compare/compare_beads.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const test::TempFile file("beads.csv", text_of(script.rest()));
  reads(file.path().string() + ":", [&] {
    const Beads beads = load_beads(file.path());
    EXPECT_EQ(beads.boundary.size() + beads.interior.size(), beads.rest.size());
  });
  return 0;
}

}  // namespace brachy::fuzz
