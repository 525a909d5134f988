// A session's directory that somebody else prepared: every file of the list by every kind of trap. Each is refused in
// one line, before anything is cut or created, and what lies outside stays as it was.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/un.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <map>

#include "apps/session/plan_change_log.h"
#include "apps/session/session_log.h"
#include "core/base/error.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

namespace fs = std::filesystem;
using test::read_file;
using test::TempFolder;

/// All that a session leaves on the disk: names below its directory.
std::vector<std::string> all_files() {
  std::vector<std::string> names;
  for (const SessionFile& file : kSessionFiles) names.emplace_back(file.name);
  names.emplace_back("plan_change_1.toml");
  names.emplace_back("states/00010.000.bin");
  return names;
}

/// What of a file can be touched.
struct Touched {
  mode_t mode = 0;
  uid_t owner = 0;
  off_t size = 0;
  std::int64_t modified_ns = 0;
  std::string content;
  bool operator==(const Touched&) const = default;
};

Touched state_of(const fs::path& file) {
  struct stat about {};
  EXPECT_EQ(::lstat(file.c_str(), &about), 0) << file;
  const bool is_read = S_ISREG(about.st_mode) && about.st_size < 1'000'000;
  return {about.st_mode, about.st_uid, about.st_size,
          about.st_mtim.tv_sec * 1'000'000'000 + about.st_mtim.tv_nsec, is_read ? read_file(file) : ""};
}

/// Every regular file and link below a directory.
std::map<std::string, Touched> states_below(const fs::path& folder) {
  std::map<std::string, Touched> states;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (!entry.is_directory()) states[entry.path().string()] = state_of(entry.path());
  return states;
}

/// A whole session in s/ with every file of the list, and somebody's text beside it.
struct SpoiltFolder : ::testing::Test {
  SpoiltFolder() {
    SessionLog log(folder / "s", 1, 0.005, std::vector<std::string>{"urethra"});
    MeshState state;
    state.summary.tick = 3;
    state.needles.states.resize(1);
    state.needles.states[0].present = true;
    state.needles.pose_histories.resize(1);
    for (std::uint64_t t = 1; t <= 3; ++t) state.needles.pose_histories[0][t].tick = t;
    log.add(state);
    log.add_state(2000, std::vector<std::byte>(100));
    Plan plan;
    plan.needles = {{"D4", 0, "s-s"}};
    PlanChangeLog(log.folder()).add(0.01, plan, {}, PlanChangeKind::kEdited, "edited by a");
    for (const char* name :
         {kStudiesFile, kManifestFile, kReportPage, kReportJson, kCatheterFile, kHdrReportFile})
      log.folder().replace(name, std::string_view());
    log.close();
  }

  /// What is said of the session; "taken": nothing.
  std::string refusal() const {
    try {
      const SessionLog log(folder / "s", 1, 0.005, std::vector<std::string>{"urethra"});
      return "taken";
    } catch (const UserError& e) {
      return e.what();
    }
  }

  /// With s/NAME replaced by `make(path)`.
  void expect_refused(const std::string& name, const std::string& part,
                      const std::function<void(const fs::path&)>& make) {
    SCOPED_TRACE(name + ", " + part);
    const fs::path file = folder / "s" / name, kept = folder / "kept";
    ASSERT_TRUE(fs::exists(file));
    fs::rename(file, kept);
    make(file);
    const auto before = states_below(folder / "");
    const std::string said = refusal();
    EXPECT_EQ(states_below(folder / ""), before);
    EXPECT_NE(said.find(name), std::string::npos) << said;
    EXPECT_NE(said.find(part), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    fs::remove_all(file);
    fs::rename(kept, file);
  }

  TempFolder folder;
  const std::string victim = folder.write("victim.txt", "somebody's text, whose last line has no end");
};

TEST_F(SpoiltFolder, IsTakenWhileItIsWhole) {
  for (const std::string& name : all_files()) EXPECT_TRUE(fs::exists(folder / "s" / name)) << name;
  EXPECT_EQ(refusal(), "taken");
}

TEST_F(SpoiltFolder, ALinkIsNeverFollowed) {
  fs::create_directory(folder / "elsewhere");
  for (const std::string& name : all_files())
    for (const std::string& to : {victim, std::string("/dev/zero"), (folder / "elsewhere").string(),
                                  (folder / "nothing").string(), std::string("/proc/self/mem")})
      expect_refused(name, "but a link", [&](const fs::path& file) { fs::create_symlink(to, file); });
  EXPECT_FALSE(fs::exists(folder / "nothing"));
}

TEST_F(SpoiltFolder, AnotherNameOfAFileIsRefused) {
  for (const std::string& name : all_files())
    expect_refused(name, "has 2 names", [&](const fs::path& file) { fs::create_hard_link(victim, file); });
}

TEST_F(SpoiltFolder, WhatIsNoFileIsRefusedAndNotWaitedFor) {
  for (const std::string& name : all_files()) {
    expect_refused(name, "but a FIFO",
                   [&](const fs::path& file) { ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0); });
    expect_refused(name, "but a directory", [&](const fs::path& file) { fs::create_directory(file); });
    expect_refused(name, "but a socket", [&](const fs::path& file) {
      sockaddr_un address{};
      address.sun_family = AF_UNIX;
      ASSERT_LT(file.string().size(), sizeof address.sun_path);
      std::strcpy(address.sun_path, file.c_str());
      const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
      ASSERT_EQ(::bind(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
      ::close(socket);
    });
  }
}

TEST_F(SpoiltFolder, ADeviceIsRefused) {
  const fs::path zero = folder / "zero";
  if (::mknod(zero.c_str(), S_IFCHR | 0600, makedev(1, 5)) != 0)
    GTEST_SKIP() << "needs the right to make devices";
  for (const std::string& name : all_files())
    expect_refused(name, "but a device", [&](const fs::path& file) {
      ASSERT_EQ(::mknod(file.c_str(), S_IFCHR | 0600, makedev(1, 5)), 0);
    });
}

TEST_F(SpoiltFolder, AnotherUsersFileIsRefused) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root, to give files away";
  for (const std::string& name : all_files())
    expect_refused(name, "belongs to another user", [&](const fs::path& file) {
      fs::copy_file(folder / "kept", file);
      ASSERT_EQ(::chown(file.c_str(), 65534, 65534), 0);
    });
}

TEST_F(SpoiltFolder, AHugeFileIsRefusedBeforeItIsRead) {
  for (const std::string& name : all_files())
    expect_refused(name, "MB, which no session has", [&](const fs::path& file) {
      const int made = ::open(file.c_str(), O_WRONLY | O_CREAT, 0600);
      ASSERT_EQ(::ftruncate(made, off_t{1} << 40), 0);  // sparse
      ::close(made);
    });
}

TEST_F(SpoiltFolder, AReadOnlyFileStaysOne) {
  for (const std::string& name : all_files())
    expect_refused(name, "is read-only", [&](const fs::path& file) {
      fs::copy_file(folder / "kept", file);
      fs::permissions(file, fs::perms::owner_read);
    });
}

TEST_F(SpoiltFolder, ItsFolderOfStatesMayBeNoLink) {
  fs::create_directory(folder / "elsewhere");
  fs::rename(folder / "s/states", folder / "kept");
  fs::create_directory_symlink(folder / "elsewhere", folder / "s/states");
  EXPECT_NE(refusal().find("states: is not a directory"), std::string::npos) << refusal();
  fs::remove(folder / "s/states");
  folder.write("s/states", "a file");
  EXPECT_NE(refusal().find("states: "), std::string::npos) << refusal();
  EXPECT_TRUE(fs::is_empty(folder / "elsewhere"));
}

TEST_F(SpoiltFolder, ItselfMayBeNoLinkAndNobodyElses) {
  fs::create_directory_symlink(folder / "s", folder / "link");
  EXPECT_THROW(SessionLog(folder / "link", 1, 0.005), UserError);
  EXPECT_THROW(SessionLog((folder / "link").string() + "/", 1, 0.005), UserError);
  EXPECT_THROW(SessionLog(victim, 1, 0.005), UserError);
  if (::geteuid() != 0) return;
  ASSERT_EQ(::chown((folder / "s").c_str(), 65534, 65534), 0);
  EXPECT_NE(refusal().find("belongs to another user"), std::string::npos) << refusal();
}

// The file that is named is kept to its last byte: nothing is cut before all has been judged.
TEST_F(SpoiltFolder, ARefusedStartCutsNothing) {
  const std::string text = "a foreign line\nand another, whose end is missing";
  for (const char* name : {kPosesFile, kForcesFile, kSeedsFile, kDropsFile, kContactsFile, kStudiesFile,
                           kPlanChangesFile, kClockFile})
    for (const std::string& foreign : {text, std::string("one line without an end"),
                                       "x" + std::string(50'000, 'y'), std::string(100'000, '\0')}) {
      SCOPED_TRACE(std::string(name) + ": " + foreign.substr(0, 30));
      const std::string whole = read_file(folder / "s" / name);
      folder.write("s/" + std::string(name), foreign);
      // A table that is fine but for its unfinished row waits, too.
      const char* other = name == std::string(kForcesFile) ? kPosesFile : kForcesFile;
      const std::string fine = read_file(folder / "s" / other);
      folder.write("s/" + std::string(other), fine + "0.5,unfinished");
      const auto before = states_below(folder / "");
      const std::string said = refusal();
      EXPECT_NE(said.find(name), std::string::npos) << said;
      EXPECT_EQ(states_below(folder / ""), before) << said;
      folder.write("s/" + std::string(name), whole);
      folder.write("s/" + std::string(other), fine);
    }
  EXPECT_EQ(refusal(), "taken");
}

TEST(SessionFolder, FilesWithoutTheirSessionAreSomebodyElses) {
  for (const std::string& name : all_files()) {
    const bool is_begun = name == kPosesFile || name == kForcesFile || name == kSeedsFile ||
                          name == kManifestFile || name.starts_with("plan_change_");
    if (is_begun) continue;
    const TempFolder folder;
    fs::create_directories((folder / "s" / name).parent_path());
    folder.write("s/" + name, "somebody's\n");
    const auto before = states_below(folder / "");
    EXPECT_THROW(SessionLog(folder / "s", 1, 0.005), UserError) << name;
    EXPECT_EQ(states_below(folder / ""), before) << name;
  }
}

TEST(SessionFolder, BelongsToOneRecorderAtATime) {
  const TempFolder folder;
  const SessionLog log(folder / "s", 1, 0.005, {}, SessionLog::Start::kLater);
  EXPECT_TRUE(fs::is_empty(folder / "s")) << "nothing before begin()";
  EXPECT_THROW(SessionLog(folder / "s", 1, 0.005), UserError);
}

TEST(SessionFolder, AFullDiskRefusesTheStartInOneLine) {
  const TempFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit none = before;
  none.rlim_cur = 0;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &none), 0);
  std::string said;
  try {
    SessionLog(folder / "s", 1, 0.005).folder().replace(kReportPage, std::string_view("page"));
  } catch (const UserError& e) {
    said = e.what();
  }
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_NE(said.find("free some space"), std::string::npos) << said;
  EXPECT_EQ(said.find('\n'), std::string::npos);
}

TEST(SessionFolder, AReportIsReplacedWholeOrNotAtAll) {
  const TempFolder folder;
  const SessionFolder session = SessionFolder::make(folder / "s");
  session.replace(kReportPage, std::string_view("old"));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 10;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(session.replace(kReportPage, std::string_view("a page of more than ten bytes")), UserError);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_EQ(read_file(folder / "s/report.html"), "old");
  EXPECT_EQ(session.names().size(), 1u) << "no half file is left";
  // What a killed process left of its own is no obstacle, and a trap in its place is not followed.
  const std::string victim = folder.write("victim", "text");
  fs::create_symlink(victim, folder / "s/.report.html.writing");
  session.replace(kReportPage, std::string_view("new"));
  EXPECT_EQ(read_file(folder / "s/report.html"), "new");
  EXPECT_EQ(read_file(victim), "text");
  EXPECT_EQ(fs::status(folder / "s/report.html").permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
}

// A trap that is set while the session runs.
TEST(SessionFolder, WhatIsExchangedWhileItRunsIsNotWrittenThrough) {
  const TempFolder folder;
  const std::string victim = folder.write("victim", "text");
  const SessionFolder session = SessionFolder::make(folder / "s");
  fs::rename(folder / "s", folder / "moved");
  fs::create_directory(folder / "s");
  fs::create_symlink(victim, folder / "s/volume_studies.jsonl");
  session.replace(kReportPage, std::string_view("page"));
  EXPECT_EQ(read_file(folder / "moved/report.html"), "page") << "the directory that was opened";
  EXPECT_TRUE(session.append_to(kStudiesFile).is_open());
  ASSERT_EQ(::unlink((folder / "moved/volume_studies.jsonl").c_str()), 0);
  fs::create_symlink(victim, folder / "moved/volume_studies.jsonl");
  EXPECT_THROW(session.append_to(kStudiesFile), UserError);
  ASSERT_EQ(::unlink((folder / "moved/volume_studies.jsonl").c_str()), 0);
  ASSERT_EQ(::mkfifo((folder / "moved/volume_studies.jsonl").c_str(), 0600), 0);
  EXPECT_THROW(session.append_to(kStudiesFile), UserError);
  EXPECT_EQ(read_file(victim), "text");
}

}  // namespace
}  // namespace brachy
