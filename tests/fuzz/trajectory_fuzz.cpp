// A trajectory file. A valid one survives writing and reading, and every pose in it is rigid.
#include <sstream>

#include "haptics/trajectory/needle_trajectories.h"
#include "haptics/trajectory/rigid_pose.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {
namespace {

std::string written(const Trajectory& trajectory) {
  std::ostringstream out;
  write_trajectory(out, trajectory);
  return out.str();
}

void expect_rigid(const RigidTransform& X) {
  EXPECT_EQ(find_defect(X), PoseDefect::kNone);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = text_of(std::as_bytes(std::span(data, size)));
  reads_lines("one", [&] {
    const std::string once = written(parse_trajectory(text, "one"));
    EXPECT_EQ(written(parse_trajectory(once, "again")), once);
  });
  reads_lines("several", [&] {
    const NeedleTrajectories all = parse_trajectories(text, "several");
    for (const auto& [id, motion] : all.needles()) {
      for (const TrajectorySample& sample : motion.samples()) expect_rigid(sample.X_WN);
      for (const double share : {0.0, 0.3, 1.0})
        if (const auto X = all.sample(id, all.start_s() + share * all.duration_s())) expect_rigid(*X);
    }
  });
  return 0;
}

}  // namespace brachy::fuzz
