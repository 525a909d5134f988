// The other CSV files, selected by the first byte. Rows that we write are read back unchanged.
#include "apps/forces/force_log.h"
#include "apps/landmarks/landmark_file.h"
#include "core/brachytherapy/dose/dose_seed_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {
namespace {

std::string written(const std::vector<Seed>& seeds) {
  std::string text = std::string(kSeedHeader) + "\n";
  for (const Seed& seed : seeds) text += seed_row(seed) + "\n";
  return text;
}

std::string written(const std::vector<ForceSample>& samples) {
  std::string text = std::string(kForceLogHeader) + "\n";
  for (const ForceSample& sample : samples) text += force_row(sample) + "\n";
  return text;
}

void read_landmarks(const std::string& text) {
  const test::TempFile file("landmarks.csv", text);
  LandmarkFieldOptions options;
  options.landmarks = file.path();
  reads_lines(file.path().string(), [&] {
    const Landmarks landmarks = load_landmarks(options);
    EXPECT_EQ(landmarks.positions.size(), landmarks.displacements.size());
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  const std::uint8_t which = script.u8() % 4;
  const std::string text = text_of(script.rest());
  switch (which) {
    case 0:
      reads_lines("seeds", [&] {
        const std::string once = written(parse_seeds(text, "seeds"));
        EXPECT_EQ(written(parse_seeds(once, "again")), once);
      });
      return 0;
    case 1:
      reads_lines("dose", [&] {
        for (const DoseSeed& seed : parse_dose_seeds(text, "dose")) EXPECT_NEAR(seed.axis.norm(), 1, 1e-9);
      });
      return 0;
    case 2:
      reads_lines("forces", [&] {
        const std::string once = written(parse_force_log(text, "forces"));
        EXPECT_EQ(written(parse_force_log(once, "again")), once);
      });
      return 0;
    default:
      read_landmarks(text);
      return 0;
  }
}

}  // namespace brachy::fuzz
