// The dose of a fraction in a running daemon: what the catheters that are in the tissue would give now.
#include <gtest/gtest.h>

#include "apps/daemon/scene_message.h"
#include "core/brachytherapy/dose/implant_dose.h"
#include "core/brachytherapy/hdr/catheter_course.h"
#include "core/brachytherapy/hdr/hdr_plan_file.h"
#include "core/scene/load_structures.h"
#include "tests/apps/applicator.h"
#include "tests/apps/apps_testing.h"
#include "tests/apps/running_daemon.h"

namespace brachy {
namespace {

using namespace test;

struct DaemonHdr : ::testing::Test {
  /// Three catheters of the shipped plan, in tissue that no needle moves.
  DaemonHdr() {
    scene = small();
    scene.implant.kind = "hdr";
    scene.needle.count = 3;
    scene.dose.prescription_gy = ImplantSettings::kFractionGy;
    scene.tissue.contact.puncture_force_n = scene.tissue.contact.cutting_force_n =
        scene.tissue.contact.friction_n_per_mm = 0;
    plan = load_hdr_plan(kConfigFolder / "hdr_plan.toml", scene.template_grid, scene.needle.length_mm);
    plan.catheters.resize(3);
    scene.plan_file = folder.write("plan.toml", to_toml(plan, scene.template_grid));
  }
  /// Poses along a catheter, from in front of the tissue.
  std::vector<RigidTransform> way(std::size_t catheter) const {
    const Vec3 tip = plan.planned_tip(scene.template_grid, catheter);
    std::vector<RigidTransform> poses;
    for (double z = -40; z < tip.z(); z += 3) poses.push_back(tip_at(tip.x(), tip.y(), z));
    poses.push_back(tip_at(tip.x(), tip.y(), tip.z()));
    return poses;
  }
  std::vector<StructureDose> dose_of(const HdrPlan& of) const {
    DoseSettings settings = scene.dose;
    settings.prescription_gy = of.prescription_gy;
    ImplantDose dose(load_structures(scene), settings);
    for (const DoseSeed& seed : of.seeds(scene.template_grid)) dose.add(seed);
    return dose.evaluate();
  }
  /// To 0.1 %.
  static void expect_same(const std::vector<StructureDose>& have, const std::vector<StructureDose>& want) {
    ASSERT_EQ(have.size(), want.size());
    for (std::size_t s = 0; s < want.size(); ++s) {
      EXPECT_NEAR(have[s].mean_gy / want[s].mean_gy, 1, 1e-3) << want[s].name;
      EXPECT_NEAR(have[s].d90_gy / want[s].d90_gy, 1, 1e-3) << want[s].name;
      EXPECT_NEAR(have[s].d10_gy / want[s].d10_gy, 1, 1e-3) << want[s].name;
      EXPECT_NEAR(have[s].v100_percent, want[s].v100_percent, 0.1) << want[s].name;
    }
  }

  TempFolder folder;
  Scene scene;
  HdrPlan plan;
};

TEST_F(DaemonHdr, TheDoseOfCathetersIsThePlansOnceTheyLieAsPlanned) {
  RunningDaemon daemon(scene);
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  ASSERT_TRUE(device.peer.until([&] { return !device.peer.doses.empty(); })) << "the plan's, at the start";
  const net::DoseMessage first = device.peer.doses.front();
  EXPECT_EQ(first.fraction, (net::DosedFraction{0, 3, 0, 0}));
  EXPECT_EQ(first.structures[0].mean_gy, 0);
  expect_same(first.with_planned, dose_of(plan));

  ASSERT_TRUE(device.go(way(0)));
  HdrPlan one = plan;
  one.catheters.resize(1);
  ASSERT_TRUE(device.peer.until([&] {
    const auto& last = device.peer.doses.back();
    return last.fraction && last.fraction->catheters == 1 &&
           std::abs(last.with_planned[0].mean_gy / first.with_planned[0].mean_gy - 1) < 1e-4;
  }));
  const net::DoseMessage last = device.peer.doses.back();
  EXPECT_EQ(last.seeds, 0u);
  EXPECT_EQ(last.fraction->dwells, one.dwell_count());
  EXPECT_NEAR(last.fraction->seconds, one.total_s(), 1e-9);
  EXPECT_EQ(last.air_kerma_strength_u, plan.source_strength_u);
  expect_same(last.structures, dose_of(one));
  expect_same(last.with_planned, dose_of(plan));

  auto back = way(0);
  std::ranges::reverse(back);
  ASSERT_TRUE(device.go(back));
  ASSERT_TRUE(device.peer.until([&] { return device.peer.doses.back().fraction->catheters == 0; }));
  EXPECT_EQ(device.peer.doses.back().structures[0].mean_gy, 0);
}

// Oblique and curved, as another planning system has it.
TEST_F(DaemonHdr, ACatheterThatFollowsItsCourseGivesThePlansDose) {
  PlanCatheter curved{.hole = {}, .tip_mm = 0, .dwell_s = {}, .name = "a3.5"};
  for (double z = 20; z >= -64; z -= 4)
    curved.course.emplace_back(6 + 0.002 * (z + 60) * (z + 60) / 2, -5 + 0.05 * z, z);
  for (double along = 3.1; along < 45; along += 4.7) {
    curved.dwell_mm.push_back(along);
    curved.dwell_s.push_back(5 + along / 10);
  }
  plan.catheters = {curved};
  scene.needle.count = 1;
  scene.contact.max_displacement_mm = 1e-3;  // as rigid as can be: what moves in soft tissue costs 0.12 %
  scene.plan_file = folder.write("curved.toml", to_toml(plan, scene.template_grid));
  RunningDaemon daemon(scene);
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  std::vector<RigidTransform> along;
  for (double offset = 60; offset >= 0; offset -= 3) {
    const Vec3 axis = course_direction(curved.course, offset);
    along.push_back({Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), axis).toRotationMatrix(),
                     point_along(curved.course, offset).position});
  }
  ASSERT_TRUE(device.go(along));
  const std::vector<StructureDose> want = dose_of(plan);
  ASSERT_TRUE(device.peer.until([&] {
    return !device.peer.doses.empty() && device.peer.doses.back().fraction->catheters == 1 &&
           std::abs(device.peer.doses.back().structures[0].mean_gy / want[0].mean_gy - 1) < 3e-4;
  }));
  expect_same(device.peer.doses.back().structures, want);
}

TEST_F(DaemonHdr, ItsGoalsAreThoseOfAFraction) {
  const net::SceneMessage message = make_scene_message(scene, std::nullopt, load_structures(scene));
  const auto urethra = std::ranges::find_if(message.goals, [](const auto& goal) {
    return goal.structure == "urethra" && goal.figure == "D10" && !goal.is_of_plan;
  });
  ASSERT_NE(urethra, message.goals.end());
  EXPECT_NEAR(urethra->limit, 1.15 * 13.5, 1e-9) << "permanent implants have 1.5";
}

TEST_F(DaemonHdr, ACatheterThatIsShortGivesItsDoseWhereItLies) {
  RunningDaemon daemon(scene);
  Applicator device;
  ASSERT_TRUE(device.join(daemon.port()));
  auto poses = way(0);
  poses.pop_back();
  const double short_mm = plan.planned_tip(scene.template_grid, 0).z() - poses.back().p.z();
  ASSERT_GT(short_mm, 0.5);
  ASSERT_TRUE(device.go(poses));
  HdrPlan one = plan;
  one.catheters.resize(1);
  one.catheters[0].tip_mm -= short_mm;
  const std::vector<StructureDose> want = dose_of(one);
  ASSERT_TRUE(device.peer.until([&] {
    return !device.peer.doses.empty() &&
           std::abs(device.peer.doses.back().structures[0].mean_gy / want[0].mean_gy - 1) < 1e-4;
  }));
  expect_same(device.peer.doses.back().structures, want);
}

TEST_F(DaemonHdr, ASessionIsScoredByTheCathetersThatLayAtItsEnd) {
  DaemonOptions options;
  options.session = folder / "session";
  std::string summary;
  {
    RunningDaemon daemon(scene, options);
    Applicator device;
    ASSERT_TRUE(device.join(daemon.port()));
    ASSERT_TRUE(device.go(way(0)));
    summary = daemon.stop().session;
  }
  const auto catheters = load_catheters(folder / "session/catheters.csv");
  ASSERT_EQ(catheters.size(), 1u);
  EXPECT_LT((catheters[0].now.front() - plan.planned_tip(scene.template_grid, 0)).norm(), 1e-3);
  const auto report = nlohmann::json::parse(read_file(folder / "session/hdr_report.json"));
  EXPECT_EQ(report["catheters"][0]["needle"], 0);
  EXPECT_TRUE(report["catheters"][1]["needle"].is_null());
  HdrPlan one = plan;
  one.catheters.resize(1);
  EXPECT_NEAR(report["dose"]["delivered"]["prostate"]["v100_percent"]["value"].get<double>(),
              dose_of(one)[0].v100_percent, 0.1);
  EXPECT_NE(summary.find("2 catheters are missing"), std::string::npos) << summary;
  EXPECT_NE(read_file(folder / "session/report.html").find("Fraction score"), std::string::npos);
}

}  // namespace
}  // namespace brachy
