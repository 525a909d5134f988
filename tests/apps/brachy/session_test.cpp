// A whole implant with the tools: plan, needles, seeds, report; and the same over the network.
#include <csignal>

#include "core/brachytherapy/seeds/seed_file.h"
#include "tests/apps/applicator.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/running_brachyd.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

constexpr const char* kTwoNeedles =
    "name = \"two needles\"\nsource = \"6711\"\nair_kerma_strength_u = 0.5\n"
    "prescription_gy = 145\nbase_plane_mm = 82\n"
    "[[needle]]\nhole = \"H7\"\nretraction_mm = 2\ntrain = \"s-s-s\"\n"
    "[[needle]]\nhole = \"F8\"\nretraction_mm = 5\ntrain = \"ss\"\n";

struct SessionTest : ::testing::Test {
  void SetUp() override {
    folder.write("plan.toml", kTwoNeedles);
    scene = folder.write("scene.toml",
                         small_scene("[plan]\nfile = \"plan.toml\"\n[seeds]\napplicator = \"train\"\n"));
    needles = (folder / "needles.csv").string();
    ASSERT_TRUE(
        exited(run_brachy({"plan", "--config", scene, "--trajectory", needles, "--speed-mm-s", "100"}), 0));
  }
  std::string in(const std::string& name) const { return (folder / name).string(); }

  TempFolder folder;
  std::string scene, needles;
};

TEST_F(SessionTest, OfAPlanEndsWithAllSeedsInTheTissueAndAReport) {
  const Ended ended =
      run_brachy({"replay", needles, "--offline", "--config", scene, "--session", in("s"), "--json"});
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended).at("seeds"), 5);
  const std::vector<Seed> seeds = load_seeds(in("s/seeds.csv"));
  ASSERT_EQ(seeds.size(), 5u);
  for (std::size_t i = 0; i < seeds.size(); ++i) EXPECT_EQ(seeds[i].planned, static_cast<int>(i));
  const auto report = nlohmann::json::parse(read_file(in("s/report.json")));
  EXPECT_NE(read_file(in("s/report.html")).find("<svg"), std::string::npos);
  EXPECT_FALSE(report.empty());
  // Nothing is overwritten.
  EXPECT_TRUE(refused_in_one_line(
      run_brachy({"replay", needles, "--offline", "--config", scene, "--session", in("s")}),
      {"already holds a recording"}));
}

// A live recording, stepped offline: the same seeds at the same positions, bit for bit.
TEST_F(SessionTest, PlayedOverTheNetworkRepeatsOffline) {
  RunningBrachyd brachyd(scene, {"--session", in("live")});
  ASSERT_TRUE(exited(run_brachy({"replay", needles, "--connect", brachyd.address, "--speed", "2"}), 0));
  brachyd.process.send_signal(SIGTERM);
  const Ended ended = brachyd.process.wait();
  ASSERT_TRUE(exited(ended, 0));
  EXPECT_EQ(json_of(ended).at("seeds_dropped"), 5);
  EXPECT_NE(ended.err.find("report.html"), std::string::npos) << ended.err;
  ASSERT_TRUE(exited(
      run_brachy({"replay", in("live/poses.csv"), "--offline", "--config", scene, "--session", in("again")}),
      0));
  const std::vector<Seed> live = load_seeds(in("live/seeds.csv")), again = load_seeds(in("again/seeds.csv"));
  ASSERT_EQ(live.size(), 5u);
  ASSERT_EQ(again.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(live[i].rest, again[i].rest) << i;
    EXPECT_EQ(live[i].dropped, again[i].dropped) << i;
    EXPECT_EQ(live[i].planned, again[i].planned) << i;
    EXPECT_EQ(live[i].gland_motion, again[i].gland_motion) << i;
  }
}

// Seeds that a client has received are in the ledger: order, count and positions, however the daemon ended.
TEST(Session, KeepsItsSeedsThroughKillMinusNine) {
  const TempFolder folder;
  const std::string scene = folder.write("scene.toml", small_scene());
  const std::string session = (folder / "session").string();
  std::vector<Seed> told;
  for (int run = 0; run < 3; ++run) {
    RunningBrachyd brachyd(scene, {"--session", session});
    Applicator device;
    ASSERT_TRUE(device.join(brachyd.port));
    ASSERT_TRUE(device.peer.until([&] { return !device.peer.frames.empty(); }));
    ASSERT_GE(device.seeds().size(), told.size());
    for (std::size_t i = 0; i < told.size(); ++i) {
      EXPECT_EQ(device.seeds()[i].id, told[i].id);
      EXPECT_EQ(device.seeds()[i].rest, told[i].rest);
      EXPECT_EQ(device.seeds()[i].dropped, told[i].dropped);
    }
    ASSERT_TRUE(device.go(way_in()));
    for (int i = 0; i < 3; ++i) ASSERT_TRUE(device.drop());
    device.peer.client.press(true);  // and one more, without waiting for it
    device.peer.client.press(false);
    device.peer.poll();
    told = device.seeds();
    brachyd.process.send_signal(SIGKILL);
    EXPECT_EQ(brachyd.process.wait().signal, SIGKILL);
    const std::vector<Seed> kept = load_seeds(session + "/seeds.csv");
    ASSERT_GE(kept.size(), told.size());
    EXPECT_LE(kept.size(), told.size() + 1);
  }
  EXPECT_GE(told.size(), 9u);
}

// Those of an earlier implant are in the body, in every client's view, in the dose, and once in the session's ledger.
TEST_F(SessionTest, SeedsOfAnEarlierImplantAreThereFromTheStart) {
  folder.write("before.csv",
               "x,y,z,ax,ay,az,source,strength_u\n2,3,4,0,0,1,6711,0.5\n-9,3,4,0,0,1,6711,0.5\n");
  scene =
      folder.write("scene.toml", small_scene("[plan]\nfile = \"plan.toml\"\n[seeds]\napplicator = \"train\"\n"
                                             "[implant]\nseeds = \"before.csv\"\n"));
  for (const std::size_t expected : {2u, 2u}) {  // begun, and gone on with
    RunningBrachyd brachyd(scene, {"--session", in("live")});
    Peer viewer;
    ASSERT_TRUE(viewer.join(brachyd.port));
    ASSERT_TRUE(viewer.until([&] { return viewer.client.mesh().seeds().size() == expected; }));
    EXPECT_EQ(viewer.client.mesh().seeds()[0].position, Vec3(2, 3, 4));
    ASSERT_TRUE(viewer.until([&] { return !viewer.doses.empty() && viewer.doses.back().seeds == expected; }));
    brachyd.process.send_signal(SIGTERM);
    ASSERT_TRUE(exited(brachyd.process.wait(), 0));
    EXPECT_EQ(load_seeds(in("live/seeds.csv")).size(), expected);
  }
  const Ended ended =
      run_brachy({"replay", needles, "--offline", "--config", scene, "--session", in("s"), "--json"});
  ASSERT_TRUE(exited(ended, 0)) << ended.err;
  const auto report = nlohmann::json::parse(read_file(in("s/report.json")));
  EXPECT_EQ(report.at("seeds").at("unplanned"), nlohmann::json::array());
  EXPECT_EQ(report.at("dose").at("rest").at("seeds"), 7);
  // Another file of seeds is another scene.
  folder.write("before.csv", "x,y,z,ax,ay,az,source,strength_u\n2,3,4.5,0,0,1,6711,0.5\n");
  EXPECT_TRUE(refused_in_one_line(run_brachy({"score", in("s"), "--force"}), {"before.csv"}));
}

}  // namespace
}  // namespace brachy
