#include "apps/recording/recorded_motion.h"

#include "core/base/error.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/recording/sample_recording.h"

namespace brachy {
namespace {

using namespace test;

RecordedMotion motion_of(const SampleMessages& messages, ReplayedModel model = ReplayedModel::kRecorded,
                         std::size_t needles = 2) {
  const TempFolder folder;
  messages.write(folder / "r.brachy");
  return load_recorded_motion(folder / "r.brachy", model, needles);
}

std::string refusal_of(const SampleMessages& messages, std::size_t needles = 2) {
  try {
    motion_of(messages, ReplayedModel::kRecorded, needles);
  } catch (const UserError& error) {
    return error.what();
  }
  return "";
}

bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(RecordedMotion, HasEveryTicksPoseAndButtonBitForBit) {
  SampleMessages messages;
  messages.add(messages.frame(4, {}));
  messages.add(messages.frame(8, {5, 6, 7, 8}));
  net::FrameMessage both = messages.frame(10, {8, 9, 10});  // 8 was there already
  both.poses_of_needles = {{1, {SampleMessages::pose(10)}}};
  messages.add(both);
  const RecordedMotion motion = motion_of(messages);
  EXPECT_TRUE(motion.remarks.empty());
  ASSERT_EQ(motion.trajectories.needles().size(), 2u);
  const auto& samples = motion.trajectories.needles()[0].motion.samples();
  ASSERT_EQ(samples.size(), 6u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const TickPose pose = SampleMessages::pose(5 + i);
    EXPECT_EQ(samples[i],
              (TrajectorySample{static_cast<double>(5 + i) * (1 / 200.0), pose.X_WN, pose.button}));
  }
  EXPECT_EQ(motion.trajectories.needles()[1].motion.samples().size(), 1u);
}

TEST(RecordedMotion, SaysWhatIsMissing) {
  SampleMessages messages;
  messages.add(messages.frame(2, {1, 2}));
  messages.add(messages.frame(300, {299, 300}));
  EXPECT_TRUE(holds(motion_of(messages).remarks.at(0), "296 ticks' poses were missed"));
  SampleMessages late;
  net::FrameMessage inside = late.frame(2, {1, 2});
  inside.needles[0].state.contact = ContactState::kInserted;
  late.add(inside);
  EXPECT_TRUE(holds(motion_of(late).remarks.at(0), "began when needles had already moved"));
}

TEST(RecordedMotion, RefusesWhatATrajectoryCannotSay) {
  SampleMessages reset;
  reset.add(reset.frame(9, {8, 9}));
  reset.add(net::EventMessage{net::EventKind::kReset, 0, 9, "reset"});
  reset.add(reset.frame(3, {1, 2, 3}));
  EXPECT_TRUE(holds(refusal_of(reset), "the simulation was reset at tick 3, which a replay cannot follow"));

  SampleMessages gone;
  gone.add(gone.frame(9, {8, 9}));
  gone.add(gone.frame(12, {}));
  EXPECT_EQ(refusal_of(gone), "");  // it just ends
  gone.add(gone.frame(20, {20}));
  EXPECT_TRUE(holds(refusal_of(gone), "needle 0 was removed at tick 12"));

  SampleMessages model;
  net::StateMessage state;
  state.ticks = 9;
  state.controls.kernel = "psi31";
  state.controls.support_radius_mm = 12;
  model.add(state);
  model.add(model.frame(9, {8, 9}));
  model.add(state);
  EXPECT_EQ(refusal_of(model), "");
  state.controls.support_radius_mm = 24;
  model.add(state);
  EXPECT_TRUE(holds(refusal_of(model), "another model was chosen at tick 9"));
  EXPECT_EQ(motion_of(model, ReplayedModel::kDaemons).trajectories.needles().size(),
            1u);  // a daemon has its own

  SampleMessages still;
  still.add(still.frame(9, {}));
  EXPECT_TRUE(holds(refusal_of(still), "no needle moves in it"));

  SampleMessages second;
  net::FrameMessage frame = second.frame(9, {9});
  frame.poses_of_needles = {{1, {SampleMessages::pose(9)}}};
  second.add(frame);
  EXPECT_TRUE(holds(refusal_of(second, 1), "raise needle.count in the scene to 2"));
}

TEST(RecordedMotion, RefusesPosesThatAreNotRigid) {
  SampleMessages bent;
  net::FrameMessage frame = bent.frame(9, {9});
  frame.pose_history[0].X_WN.R(0, 0) = 2;
  bent.add(frame);
  EXPECT_TRUE(holds(refusal_of(bent), "the pose of tick 9 is not rigid"));
}

}  // namespace
}  // namespace brachy
