// A session's directory, as a killed daemon may have left it: seeds.csv, poses.csv and forces.csv, a piece each. It is
// scored, continued, and read again: no seed that was read is lost.
#include <filesystem>

#include "apps/score/recording.h"
#include "apps/session/session_log.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {
namespace {

constexpr std::size_t kNeedles = 3;

std::size_t seeds_in(const std::filesystem::path& folder) {
  std::size_t seeds = 0;
  reads(folder.string(), [&] {
    const Recording recording = load_recording(folder);
    if (recording.seeds) seeds = recording.seeds->size();
    for (const std::string& remark : recording.remarks) EXPECT_TRUE(remark.ends_with('.')) << remark;
  });
  return seeds;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const test::TempFile folder("session");
  std::filesystem::create_directory(folder.path());
  Script script(data, size);
  for (const char* file : {"seeds.csv", "poses.csv", "forces.csv"})
    if (const auto content = script.piece(); !content.empty())
      std::ofstream(folder.path() / file, std::ios::binary) << text_of(content);
  const std::size_t before = seeds_in(folder.path());
  const bool goes_on = reads(folder.path().string(), [&] {
    SessionLog log(folder.path(), kNeedles, 0.005);
    EXPECT_EQ(log.restored().size(), before);
    log.add_poses({{0, {1, RigidTransform(), true}}});
    log.close();
  });
  if (goes_on) {
    EXPECT_EQ(seeds_in(folder.path()), before);
  }
  return 0;
}

}  // namespace brachy::fuzz
