// `brachy compare`, `stability`, `ticks`, `zwidth` and `deflection`, which run brachy-study: a copy of brachy in a
// directory without it, and beside a script of that name.
#include "apps/command_line/study_commands.h"
#include "test_paths.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;
namespace fs = std::filesystem;

struct ExecStudy : ::testing::Test {
  ExecStudy() { fs::copy_file(BRACHY_BINARY, brachy); }

  Ended run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), brachy.string());
    return run_process(arguments);
  }

  TempFolder folder;
  fs::path brachy = folder / "brachy", study = folder / "brachy-study";
};

TEST_F(ExecStudy, AMissingProgramIsNamedWithTheFix) {
  for (const StudyCommand& command : kStudyCommands)
    EXPECT_TRUE(
        refused_in_one_line(run({command.name, "--quick"}),
                            {"brachy: ", std::string(command.name) + " needs " + study.string() + ", ",
                             "(No such file or directory)", "install the package brachyd-lab",
                             "build it with scripts/build.sh release brachy-study"}));
}

TEST_F(ExecStudy, AFileThatIsNoProgramIsNamedWithTheReason) {
  folder.write("brachy-study", "#!/bin/sh\n");
  EXPECT_TRUE(refused_in_one_line(run({"compare"}), {study.string(), "(Permission denied)"}));
}

TEST_F(ExecStudy, ArgumentsOutputAndExitCodeAreThoseOfTheProgram) {
  folder.write("brachy-study", "#!/bin/sh\necho \"$@\"\necho failed >&2\nexit 7\n");
  fs::permissions(study, fs::perms::owner_all);
  const Ended ended = run({"stability", "--sweeps", "push, plane"});
  EXPECT_TRUE(exited(ended, 7));
  EXPECT_EQ(ended.out, "stability --sweeps push, plane\n");
  EXPECT_EQ(ended.err, "failed\n");
}

TEST_F(ExecStudy, OtherCommandsAndTheHelpDoNotNeedIt) {
  const Ended help = run({"--help"});
  EXPECT_TRUE(exited(help, 0));
  for (const StudyCommand& command : kStudyCommands)
    EXPECT_NE(help.out.find(command.summary), std::string::npos) << command.name;
  EXPECT_TRUE(exited(run({"deform", "--help"}), 0));
}

}  // namespace
}  // namespace brachy
