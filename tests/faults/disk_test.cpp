// No space left: on a separate full disk, and under a file size limit.
#include <csignal>
#include <filesystem>

#include "apps/forces/force_log.h"
#include "apps/recording/recording_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "haptics/trajectory/needle_trajectories.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/peer.h"
#include "tests/apps/running_brachyd.h"

namespace brachy {
namespace {

using namespace brachy::test;

enum class Shortage { kFullDisk, kFileLimit };

struct DiskTest : ::testing::TestWithParam<Shortage> {
  void SetUp() override {
    std::filesystem::create_directory(disk);
    std::filesystem::create_directory(kept);
    if (GetParam() == Shortage::kFileLimit) return;
    const Ended tried = run_process(
        {"/usr/bin/unshare", "-rm", "/bin/sh", "-c", "mount -t tmpfs -o size=64k tmpfs \"$0\"", disk});
    if (tried.exit_code != 0) GTEST_SKIP() << "no file system may be mounted here: " << tried.err;
  }
  /// The command that runs a program with space for `bytes` in `disk`, and then copies the content of `disk` to `kept`.
  std::vector<std::string> with_space_for(std::size_t bytes) const {
    const std::string size = std::to_string(bytes);
    if (GetParam() == Shortage::kFullDisk)
      return {"/usr/bin/unshare",
              "-rm",
              "/bin/sh",
              "-c",
              "mount -t tmpfs -o size=" + size +
                  " tmpfs \"$0\" && { \"$@\"; code=$?; "
                  "cp -r \"$0\"/. " +
                  kept + "; exit $code; }",
              disk};
    return {"/bin/sh", "-c",
            "(ulimit -f " + std::to_string(bytes / 512) + "; exec \"$@\"); code=$?; cp -r \"$0\"/. " + kept +
                "; exit $code",
            disk};
  }
  std::string reason() const {
    return GetParam() == Shortage::kFullDisk ? "No space left" : "File too large";
  }
  /// The program's process: the only child of that command.
  static void end_child_of(pid_t pid) {
    const std::string children =
        "/proc/" + std::to_string(pid) + "/task/" + std::to_string(pid) + "/children";
    ::kill(std::stoi(read_file(children)), SIGTERM);
  }

  const TempFolder folder;
  const std::string disk = (folder / "disk").string(), kept = (folder / "kept").string();
  const std::string scene = folder.write("scene.toml", small_scene());
  const std::string insertion = folder.write("insertion.csv", short_insertion(3));
};

TEST_P(DiskTest, ASessionThatFindsNoSpaceIsToldOnceAndTheDaemonGoesOn) {
  RunningBrachyd brachyd(
      scene, {"--trajectory", insertion, "--play", "--session", disk + "/session", "--duration", "60"},
      with_space_for(32 * 1024));
  Peer viewer;
  ASSERT_TRUE(viewer.join(brachyd.port));
  const auto warnings = [&] {
    return std::ranges::count_if(viewer.events, [&](const auto& event) {
      return event.kind == net::EventKind::kWarning && event.text.find(reason()) != std::string::npos;
    });
  };
  ASSERT_TRUE(viewer.until([&] { return warnings() == 1; }));
  const std::size_t frames = viewer.frames.size();
  EXPECT_TRUE(viewer.until([&] { return viewer.frames.size() > frames + 30; }));
  EXPECT_EQ(warnings(), 1);
  end_child_of(brachyd.process.pid());
  const Ended ended = brachyd.process.wait();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_NE(ended.err.find(reason()), std::string::npos) << ended.err;
  const auto poses = load_trajectories(kept + "/session/poses.csv");
  EXPECT_GT(poses.end_s(), 0.2);
  EXPECT_FALSE(load_force_log(kept + "/session/forces.csv").empty());
  EXPECT_TRUE(load_seeds(kept + "/session/seeds.csv").empty());
}

TEST_P(DiskTest, ARecordingThatFindsNoSpaceEndsWithTheReasonAndIsReadable) {
  RunningBrachyd brachyd(scene, {"--trajectory", insertion, "--play"});
  std::vector<std::string> line = with_space_for(1 << 20);
  for (const std::string& argument :
       brachy_line({"record", "--connect", brachyd.address, "--out", disk + "/r.brachy"}))
    line.push_back(argument);
  const Ended ended = run_process(line);
  EXPECT_TRUE(exited(ended, 1));
  EXPECT_NE(ended.err.find("cannot be written any more"), std::string::npos) << ended.err;
  RecordingReader reader(kept + "/r.brachy");
  RecordingReader::Message message;
  std::size_t messages = 0;
  while (reader.next(message)) ++messages;
  EXPECT_EQ(reader.damage(), "");
  EXPECT_GT(messages, 10u);
  EXPECT_GT(reader.offset(), 100'000u);
  EXPECT_TRUE(exited(run_brachy({"inspect", kept + "/r.brachy"}), 0));
  EXPECT_TRUE(exited(run_brachy({"replay", kept + "/r.brachy", "--offline", "--config", scene}), 0));
  Peer viewer;
  EXPECT_TRUE(viewer.join(brachyd.port)) << "the daemon did not notice";
}

INSTANTIATE_TEST_SUITE_P(Short, DiskTest, ::testing::Values(Shortage::kFullDisk, Shortage::kFileLimit),
                         [](const auto& given) {
                           return given.param == Shortage::kFullDisk ? "OfADisk" : "OfAFilesLimit";
                         });

}  // namespace
}  // namespace brachy
