// A session's files while they are written, after a kill, when resumed, and on a full disk.
#include "apps/session/session_log.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "core/base/error.h"
#include "core/brachytherapy/seeds/failed_drop_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/brachytherapy/structures/organ_pass_file.h"
#include "core/scene/file/scene_file.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using test::read_file;
using test::TempFolder;

std::vector<Seed> seeds(std::size_t count) {
  std::vector<Seed> all(count);
  for (std::size_t i = 0; i < count; ++i) {
    all[i].id = static_cast<std::uint32_t>(i + 1);
    all[i].t_s = 0.5 * static_cast<double>(i + 1);
    all[i].air_kerma_strength_u = 0.4;
    all[i].rest = all[i].position = Vec3(static_cast<double>(i), 1.0 / 3, 2);
  }
  return all;
}

SessionFolder session_in(const TempFolder& folder) {
  return SessionFolder::make(folder / "");
}

void append_text(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::app | std::ios::binary) << text;
}

TEST(SeedLedger, KeepsWhatWasAppendedAndOnlyWhatIsNew) {
  const TempFolder folder;
  {
    SeedLedger ledger(session_in(folder));
    ledger.append(seeds(2));
    ledger.append(seeds(2));
    EXPECT_EQ(load_seeds(folder / "seeds.csv"), seeds(2));  // before it is closed
    ledger.append(seeds(5));
    EXPECT_EQ(ledger.count(), 5u);
  }
  SeedLedger again(session_in(folder));
  EXPECT_EQ(again.restored(), seeds(5));
  again.append(seeds(6), 100);
  const std::vector<Seed> all = load_seeds(folder / "seeds.csv");
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[5].t_s, 103);
  EXPECT_EQ(all[4].t_s, 2.5);
}

// A process may die at any byte of a row.
TEST(SeedLedger, CutsOffARowThatWasNotFinishedWhereverItEnds) {
  const TempFolder folder;
  const std::string whole = std::string(kSeedHeader) + "\n" + seed_row(seeds(1)[0]) + "\n";
  const std::string row = seed_row(seeds(2)[1]);
  for (const std::size_t torn : {std::size_t{1}, std::size_t{2}, row.size() / 2, row.size()}) {
    const std::string file = folder.write("seeds.csv", whole + row.substr(0, torn));
    SeedLedger ledger(session_in(folder));
    EXPECT_TRUE(ledger.had_partial_row());
    EXPECT_EQ(ledger.restored(), seeds(1));
    ledger.append(seeds(2));
    EXPECT_EQ(load_seeds(file), seeds(2));
  }
  folder.write("seeds.csv", std::string(kSeedHeader).substr(0, 10));
  EXPECT_TRUE(SeedLedger(session_in(folder)).restored().empty());
}

TEST(SeedLedger, OfWhichARowInTheMiddleIsWrongIsRefused) {
  const TempFolder folder;
  const std::string file =
      folder.write("seeds.csv", std::string(kSeedHeader) + "\nnonsense\n" + seed_row(seeds(1)[0]) + "\n");
  try {
    SeedLedger ledger(session_in(folder));
    FAIL() << "taken";
  } catch (const UserError& e) {
    EXPECT_NE(std::string(e.what()).find("seeds.csv:2"), std::string::npos) << e.what();
  }
}

TEST(SeedLedger, BelongsToOneProcessAtATime) {
  const TempFolder folder;
  const SeedLedger ledger(session_in(folder));
  EXPECT_THROW(SeedLedger(session_in(folder)), UserError);
}

// RLIMIT_FSIZE ends within the third row.
TEST(SeedLedger, WithoutSpaceNothingIsHalfWrittenAndTheNextCallTriesAgain) {
  const TempFolder folder;
  SeedLedger ledger(session_in(folder));
  ledger.append(seeds(2));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = std::filesystem::file_size(folder / "seeds.csv") + 20;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(ledger.append(seeds(4)), std::runtime_error);
  EXPECT_THROW(ledger.append(seeds(4)), std::runtime_error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_EQ(load_seeds(folder / "seeds.csv"), seeds(2));
  ledger.append(seeds(4));
  EXPECT_EQ(load_seeds(folder / "seeds.csv"), seeds(4));
}

/// A state of one needle whose poses of the last ticks are known.
MeshState state_at(std::uint64_t tick) {
  MeshState state;
  state.summary.tick = tick;
  state.needles.states.resize(1);
  state.needles.states[0].present = true;
  state.needles.pose_histories.resize(1);
  constexpr std::uint64_t kRing = NeedleStates::kPoseHistory;
  for (std::uint64_t t = tick > kRing ? tick - kRing + 1 : 1; t <= tick; ++t) {
    TickPose& pose = state.needles.pose_histories[0][t % kRing];
    pose.tick = t;
    pose.X_WN.p.z() = static_cast<double>(t);
    pose.button = t % 10 == 0;
  }
  state.seeds.slots = seeds(tick / 50);
  state.seeds.count = static_cast<std::uint32_t>(tick / 50);
  return state;
}

TEST(SessionLog, HasEveryTicksPoseOfSnapshotsThatSkipTicks) {
  const TempFolder folder;
  SessionLog log(folder / "s", 1, 0.005);
  for (const std::uint64_t tick : {1, 7, 14, 100, 200}) log.add(state_at(tick));
  log.close();
  EXPECT_EQ(log.poses(), 200u);
  EXPECT_EQ(log.forces(), 5u);
  EXPECT_EQ(log.ticks_missed(), 0u);
  const NeedleTrajectories poses = load_trajectories(folder / "s/poses.csv");
  const auto& samples = poses.needles()[0].motion.samples();
  ASSERT_EQ(samples.size(), 200u);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_DOUBLE_EQ(samples[i].t_s, 0.005 * static_cast<double>(i + 1));
    EXPECT_EQ(samples[i].X_WN.p.z(), static_cast<double>(i + 1));
    EXPECT_EQ(samples[i].button, (i + 1) % 10 == 0);
  }
  EXPECT_EQ(load_seeds(folder / "s/seeds.csv").size(), 4u);
}

/// Where a needle is that rests, moves, rests with its button pressed, is away for a while, and rests again.
std::optional<TickPose> pose_of(std::uint32_t needle, std::uint64_t tick) {
  const std::uint64_t t = tick + 37 * needle;
  if (t % 500 >= 400 && t % 500 < 430) return std::nullopt;
  TickPose pose;
  pose.tick = tick;
  pose.button = t % 200 > 150;
  pose.X_WN.R =
      Eigen::AngleAxisd(0.1 + 0.01 * static_cast<double>(needle), Vec3(1, 2, 2) / 3).toRotationMatrix();
  pose.X_WN.p = Vec3(needle, 1.0 / 3,
                     static_cast<double>(t / 500) + (t % 500 > 450 ? 0.01 * static_cast<double>(t) : 0));
  return pose;
}

// In pieces of every length: each tick's pose is what a replay samples, bit for bit.
TEST(SessionLog, OfNeedlesAtRestTheEndsAreEnough) {
  constexpr std::uint64_t kTicks = 2'000;
  constexpr std::uint32_t kNeedles = 5;
  for (const std::uint64_t piece : {1U, 7U, 64U, 500U}) {
    const TempFolder folder;
    SessionLog log(folder / "s", kNeedles, 0.005);
    for (std::uint64_t begin = 1; begin <= kTicks; begin += piece) {
      std::vector<UsedPose> poses;
      for (std::uint32_t needle = kNeedles; needle-- > 0;)
        for (std::uint64_t tick = begin; tick < std::min(begin + piece, kTicks + 1); ++tick)
          if (const auto pose = pose_of(needle, tick)) poses.push_back({needle, *pose});
      log.add_poses(std::move(poses));
    }
    log.close();
    EXPECT_LT(log.poses(), kTicks * kNeedles / 5);
    const NeedleTrajectories read = load_trajectories(folder / "s/poses.csv");  // refuses what is not sorted
    for (std::uint32_t needle = 0; needle < kNeedles; ++needle)
      for (std::uint64_t tick = 1; tick <= kTicks; ++tick) {
        const auto pose = pose_of(needle, tick);
        if (!pose) continue;
        const double t_s = 0.005 * static_cast<double>(tick);
        const auto found = read.sample(needle, t_s);
        ASSERT_TRUE(found) << needle << ", " << tick;
        ASSERT_TRUE(found->p == pose->X_WN.p && found->R == pose->X_WN.R) << needle << ", " << tick;
        ASSERT_EQ(read.button(needle, t_s), pose->button) << needle << ", " << tick;
      }
  }
}

// Half of the ticks are missed for a while; a second run goes on.
TEST(SessionLog, HasTheClockOfAMachineThatIsLate) {
  const TempFolder folder;
  for (int run = 0; run < 2; ++run) {
    SessionLog log(folder / "s", 1, 0.005, std::vector<std::string>());
    for (std::uint64_t tick = 0; tick <= 1400; tick += 7) {
      MeshState state = state_at(tick);
      state.seeds.count = 0;
      state.needles.states[0].present = tick > 0;  // the run before ended at this time
      const std::uint64_t late_ticks = tick < 400 ? 0 : std::min<std::uint64_t>(tick - 400, 600);
      state.summary.publish_ns = 77'000'000'000 + static_cast<std::int64_t>(5'000'000 * (tick + late_ticks));
      log.add(state);
    }
    log.close();
  }
  const SessionClock clock = SessionClock::parse(read_file(folder / "s/clock.csv"), "clock.csv");
  EXPECT_NEAR(clock.wall_s(1.5), 1.5, 0.06);
  EXPECT_NEAR(clock.wall_s(4.0), 6.0, 0.06);  // 400 ticks late
  EXPECT_NEAR(clock.wall_s(6.5), 9.5, 0.06);
  EXPECT_NEAR(clock.wall_s(7.0 + 1.5), 10.0 + 1.5, 0.06);
  EXPECT_NEAR(clock.wall_s(7.0 + 6.5), 10.0 + 9.5, 0.06);
  EXPECT_NEAR(clock.missed_share(), 0.3, 0.01);
}

TEST(SessionLog, OfStatesThatNoLoopPublishedHasNoClock) {
  const TempFolder folder;
  SessionLog log(folder / "s", 1, 0.005, std::vector<std::string>());
  for (const std::uint64_t tick : {1, 100, 200}) log.add(state_at(tick));
  log.close();
  EXPECT_EQ(read_file(folder / "s/clock.csv"), std::string(kSessionClockHeader) + "\n");
}

TEST(SessionLog, ItsForcesHaveTheTipsDeflection) {
  const TempFolder folder;
  SessionLog log(folder / "s", 1, 0.005);
  MeshState state = state_at(1);
  state.needles.states[0].shape.is_bent = true;
  state.needles.states[0].shape.tip_deflection = Vec3(3, 4, 0);
  log.add(state);
  log.close();
  EXPECT_EQ(load_force_log(folder / "s/forces.csv").at(0).tip_deflection_mm, 5);
}

TEST(SessionLog, CountsTicksThatCameTooLate) {
  const TempFolder folder;
  SessionLog log(folder / "s", 1, 0.005);
  log.add(state_at(1));
  log.add(state_at(200));
  EXPECT_EQ(log.ticks_missed(), 200 - 1 - NeedleStates::kPoseHistory);
}

TEST(SessionLog, GoesOnWithAKilledOnesWhereItsTimeEnded) {
  const TempFolder folder;
  {
    SessionLog log(folder / "s", 1, 0.005);
    log.add(state_at(100));
    log.close();
  }
  append_text(folder / "s/poses.csv", "0.505,1,0");
  append_text(folder / "s/forces.csv", "0.50");
  append_text(folder / "s/seeds.csv", "3,");
  {
    SessionLog log(folder / "s", 1, 0.005);
    EXPECT_EQ(log.restored(), seeds(2));
    EXPECT_DOUBLE_EQ(log.offset_s(), 1) << "the last seed's";
    EXPECT_NE(log.restored_text().find("2 seeds"), std::string::npos) << log.restored_text();
    MeshState state = state_at(10);
    state.seeds.slots = seeds(3);
    state.seeds.count = 3;
    log.add(state);
    log.close();
  }
  const auto poses = load_trajectories(folder / "s/poses.csv");
  EXPECT_EQ(poses.needles()[0].motion.samples().size(), 110u);
  EXPECT_DOUBLE_EQ(poses.end_s(), 1.05);
  EXPECT_EQ(load_force_log(folder / "s/forces.csv").size(), 2u);
  const std::vector<Seed> all = load_seeds(folder / "s/seeds.csv");
  ASSERT_EQ(all.size(), 3u);
  EXPECT_DOUBLE_EQ(all[2].t_s, 2.5);  // 1.5 s into the second run
}

/// A folder with a recording of 0.5 s, and what is said of it once `spoil` has changed it.
struct SpoiltSession : ::testing::Test {
  SpoiltSession() {
    SessionLog log(folder / "s", 1, 0.005);
    log.add(state_at(100));
    log.close();
  }
  std::string refusal() const {
    try {
      SessionLog log(folder / "s", 1, 0.005);
      return "taken: " + log.restored_text();
    } catch (const UserError& e) {
      return e.what();
    }
  }
  bool says(const std::string& part) const {
    const std::string said = refusal();
    EXPECT_NE(said.find(part), std::string::npos) << said;
    return said.find(part) != std::string::npos;
  }

  TempFolder folder;
};

TEST_F(SpoiltSession, WhoseLastRowIsNoneIsNotGoneOnWith) {
  const std::string poses = read_file(folder / "s/poses.csv"), forces = read_file(folder / "s/forces.csv");
  for (const char* row :
       {"nonsense\n", "nan,0,0,0,0,0,0,1,0\n", "1e300,0,0,0,0,0,0,1,0\n", "0.505,1,0\n", "\n"}) {
    folder.write("s/poses.csv", poses + row);
    EXPECT_TRUE(says("poses.csv: its last row")) << row;
  }
  folder.write("s/poses.csv", poses);
  for (const char* row : {"nonsense\n", "0.505,0,free\n"}) {
    folder.write("s/forces.csv", forces + row);
    EXPECT_TRUE(says("forces.csv: its last row")) << row;
  }
  folder.write("s/forces.csv", "another,header\n" + forces);
  EXPECT_TRUE(says("forces.csv:1: not a force log"));
}

TEST_F(SpoiltSession, GoesOnAfterTheLatestOfTheThree) {
  std::string forces = read_file(folder / "s/forces.csv");
  const std::size_t row = forces.find('\n') + 1;
  folder.write("s/forces.csv", forces + "7.25" + forces.substr(forces.find(',', row)));
  const SessionLog log(folder / "s", 1, 0.005);
  EXPECT_DOUBLE_EQ(log.offset_s(), 7.25);
}

TEST_F(SpoiltSession, ForcesOfBeforeNeedlesBentAreContinuedInTheirColumns) {
  const std::vector<ForceSample> before = load_force_log(folder / "s/forces.csv");
  std::string text = std::string(kRigidForceLogHeader) + "\n";
  for (const ForceSample& sample : before) text += force_row(sample, ForceColumns::kRigid) + "\n";
  folder.write("s/forces.csv", text);
  {
    SessionLog log(folder / "s", 1, 0.005);
    EXPECT_EQ(log.restored_text().find("forces"), std::string::npos);
    MeshState state = state_at(10);
    state.needles.states[0].shape.is_bent = true;
    state.needles.states[0].shape.tip_deflection = Vec3(3, 4, 0);
    log.add(state);
    log.close();
  }
  const std::vector<ForceSample> after = load_force_log(folder / "s/forces.csv");
  EXPECT_EQ(after.size(), before.size() + 1);
  EXPECT_TRUE(read_file(folder / "s/forces.csv").starts_with(text));
  EXPECT_EQ(after.back().tip_deflection_mm, 0);
}

TEST_F(SpoiltSession, AMissingOrBlankFileBesideOthersIsTold) {
  std::filesystem::remove(folder / "s/seeds.csv");
  folder.write("s/forces.csv", " \n\n");
  EXPECT_TRUE(says("taken: of the earlier run forces.csv is blank, seeds.csv is missing"));
  EXPECT_EQ(read_file(folder / "s/forces.csv"), std::string(kForceLogHeader) + "\n");
  EXPECT_EQ(refusal(), "taken: ") << "whole again";
}

TEST_F(SpoiltSession, AFifoOrADeviceIsRefusedAndNotWaitedFor) {
  for (const char* name : {"poses.csv", "forces.csv", "seeds.csv"}) {
    const std::filesystem::path file = folder / "s" / name;
    std::filesystem::rename(file, folder / "kept");
    ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
    EXPECT_TRUE(says("is not a regular file")) << name;
    std::filesystem::remove(file);
    std::filesystem::create_symlink("/dev/null", file);
    EXPECT_TRUE(says("is not a regular file")) << name;
    std::filesystem::remove(file);
    std::filesystem::rename(folder / "kept", file);
  }
}

TEST_F(SpoiltSession, ItsFilesAreTheOwnersAlone) {
  using std::filesystem::perms;
  for (const char* name : {"poses.csv", "forces.csv", "seeds.csv"})
    EXPECT_EQ(std::filesystem::status(folder / "s" / name).permissions(),
              perms::owner_read | perms::owner_write)
        << name;
}

TEST_F(SpoiltSession, AFolderWithoutPermissionIsCalledThat) {
  if (::geteuid() != 0) GTEST_SKIP() << "needs root, to become somebody else";
  std::filesystem::permissions(folder / "s", std::filesystem::perms::owner_all);
  ASSERT_EQ(::seteuid(65534), 0);  // nobody
  const std::string said = refusal();
  std::string scene;
  try {
    load_scene(folder / "s/scene.toml");
  } catch (const UserError& e) {
    scene = e.what();
  }
  ASSERT_EQ(::seteuid(0), 0);
  EXPECT_NE(said.find("no permission to "), std::string::npos) << said;
  EXPECT_NE(scene.find("no permission to enter the folder"), std::string::npos) << scene;
}

// The failure is reported once by flush() and again by close(); written rows are complete, and seeds have their own
// file.
TEST(SessionLog, WithoutSpaceSaysSoOnceAndStaysReadable) {
  const TempFolder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 10'000;
  SessionLog log(folder / "s", 1, 0.005);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  int told = 0;
  for (std::uint64_t tick = 7; tick <= 2000; tick += 7) {
    MeshState state = state_at(tick);
    state.seeds.slots = seeds(tick / 700);
    state.seeds.count = static_cast<std::uint32_t>(tick / 700);
    log.add(state);
    try {
      log.flush();
    } catch (const std::runtime_error& e) {
      ++told;
      EXPECT_NE(std::string(e.what()).find("poses.csv"), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW(log.close(), std::runtime_error);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, previous);
  EXPECT_EQ(told, 1);
  const auto poses = load_trajectories(folder / "s/poses.csv");
  EXPECT_GT(poses.needles()[0].motion.samples().size(), 50u);
  EXPECT_EQ(poses.needles()[0].motion.samples().size(), log.poses());
  EXPECT_FALSE(load_force_log(folder / "s/forces.csv").empty());
  EXPECT_EQ(load_seeds(folder / "s/seeds.csv"), seeds(2));
}

TEST(SessionLog, OfAnotherNumberOfNeedlesIsRefused) {
  const TempFolder folder;
  { SessionLog log(folder / "s", 1, 0.005); }
  EXPECT_THROW(SessionLog(folder / "s", 2, 0.005), UserError);
}

// What a client is told stands in the files before, so that a killed daemon has lost nothing that was told.
TEST(SessionLog, LostAndRefusedSeedsAndPassesAreWrittenBeforeTheNextTick) {
  const TempFolder folder;
  MeshState state;
  state.needles.states.resize(1);
  state.needles.pose_histories.resize(1);
  state.needles.organ_contacts.resize(1);
  SessionLog log(folder / "s", 1, 0.005, std::vector<std::string>{"urethra"});
  state.summary.tick = 40;
  state.failed_drops.count = 2;
  state.failed_drops.slots[0] = {38, 0.19, 0, 3, DropRefusal::kLost, Vec3(1, 2, -80)};
  state.failed_drops.slots[1] = {40, 0.2, 0, -1, DropRefusal::kNothingLoaded, Vec3(0, 0, 5)};
  state.needles.organ_contacts[0] = {.is_in = true, .passes = 1, .entered_tick = 39, .depth_mm = 1};
  log.add(state);
  log.flush();
  const auto drops = parse_failed_drops(read_file(folder / "s/drops.csv"), "drops.csv");
  ASSERT_EQ(drops.size(), 2u);
  EXPECT_EQ(drops[0].why, DropRefusal::kLost);
  EXPECT_EQ(drops[0].planned, 3);
  EXPECT_EQ(drops[0].at, Vec3(1, 2, -80));
  EXPECT_EQ(drops[1].why, DropRefusal::kNothingLoaded);
  auto passes = parse_organ_passes(read_file(folder / "s/contacts.csv"), "contacts.csv");
  ASSERT_EQ(passes.size(), 1u);
  EXPECT_FALSE(passes[0].is_ended);

  state.summary.tick = 60;
  state.needles.organ_contacts[0].is_in = false;
  state.needles.organ_contacts[0].left_tick = 55;
  state.needles.organ_contacts[0].depth_mm = 2.5;
  log.add(state);
  log.add(state);
  log.flush();
  passes = parse_organ_passes(read_file(folder / "s/contacts.csv"), "contacts.csv");
  ASSERT_EQ(passes.size(), 1u);
  EXPECT_TRUE(passes[0].is_ended);
  EXPECT_EQ(passes[0].depth_mm, 2.5);
  EXPECT_EQ(parse_failed_drops(read_file(folder / "s/drops.csv"), "drops.csv").size(), 2u);
}

TEST(SessionLog, SeedsThatAnEarlierRunLostAreKnownToTheNext) {
  const TempFolder folder;
  {
    MeshState state;
    state.needles.states.resize(1);
    state.needles.pose_histories.resize(1);
    SessionLog log(folder / "s", 1, 0.005, std::vector<std::string>{});
    state.summary.tick = 1;
    state.failed_drops.count = 2;
    state.failed_drops.slots[0] = {1, 0.005, 0, 7, DropRefusal::kLost, Vec3::Zero()};
    state.failed_drops.slots[1] = {1, 0.005, 0, 8, DropRefusal::kFolded, Vec3::Zero()};
    log.add(state);
    log.close();
  }
  append_text(folder / "s/drops.csv", "5,0.0");  // a row that was not finished
  const SessionLog next(folder / "s", 1, 0.005, std::vector<std::string>{});
  EXPECT_EQ(next.restored_lost(), (std::vector<std::int32_t>{7}));
}

TEST(SessionLog, APassUnderWayIsWrittenWhenTheSessionEnds) {
  const TempFolder folder;
  MeshState state;
  state.needles.states.resize(1);
  state.needles.pose_histories.resize(1);
  SessionLog log(folder / "s", 1, 0.005, std::vector<std::string>{"rectum"});
  state.summary.tick = 10;
  state.needles.organ_contacts = {
      {.is_in = true, .passes = 1, .entered_tick = 5, .depth_mm = 3, .time_s = 0.025}};
  log.add(state);
  log.close();
  const auto passes = parse_organ_passes(read_file(folder / "s/contacts.csv"), "contacts.csv");
  ASSERT_EQ(passes.size(), 1u);
  EXPECT_TRUE(passes[0].is_ended);
  EXPECT_EQ(passes[0].depth_mm, 3);
}

}  // namespace
}  // namespace brachy
