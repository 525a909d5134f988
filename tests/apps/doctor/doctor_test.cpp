#include <gtest/gtest.h>

#include "apps/doctor/doctor_report.h"
#include "apps/doctor/fitting.h"
#include "core/scene/file/scene_file.h"
#include "core/scene/load_body.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

/// 1,000 ticks of which 99 in 100 take no more than this.
TrialResult ticks_of(double p99_ms, std::uint64_t missed = 0, std::uint64_t control_missed = 0) {
  return {.ticks = 1000 - missed,
          .missed = missed,
          .control_ticks = 1000 - control_missed,
          .control_missed = control_missed,
          .tick_p50_ms = 0.5 * p99_ms,
          .tick_p99_ms = p99_ms,
          .tick_max_ms = 1.2 * p99_ms,
          .lateness_p99_ms = 0.1};
}

Trial trial(double hz, const TrialResult& result) {
  return {"psi31", 12, hz, {}, result};
}

TEST(Doctor, ASceneFitsThatLeavesMarginAndMissesNoMoreThanTheMachine) {
  EXPECT_TRUE(fits(trial(200, ticks_of(3.7))));
  EXPECT_FALSE(fits(trial(200, ticks_of(3.8)))) << "three quarters of 5 ms";
  EXPECT_TRUE(fits(trial(200, ticks_of(1, 2)))) << "one in a thousand, and one";
  EXPECT_FALSE(fits(trial(200, ticks_of(1, 3))));
  EXPECT_TRUE(fits(trial(200, ticks_of(1, 12, 10)))) << "the machine misses as many";
  EXPECT_FALSE(fits(trial(200, TrialResult{})));
}

TEST(Doctor, ALowerRateLeavesMargin) {
  EXPECT_EQ(lower_rate(trial(200, ticks_of(5))), 150);
  EXPECT_EQ(lower_rate(trial(200, ticks_of(6))), 100);
  EXPECT_EQ(lower_rate(trial(200, ticks_of(1, 50))), 150) << "one that misses although its ticks are short";
  EXPECT_EQ(lower_rate(trial(1000, ticks_of(1.4))), 500);
  EXPECT_EQ(lower_rate(trial(200, ticks_of(80))), std::nullopt);
}

TEST(Doctor, CheaperModelsAreChartedToBeCheaperAndTheMostAccurateOnesFirst) {
  Scene scene;
  scene.model.kernel = "elastic";
  const auto models = cheaper_models(scene, load_body(scene), stored_comparison());
  ASSERT_FALSE(models.empty());
  for (std::size_t i = 1; i < models.size(); ++i) {
    EXPECT_GE(models[i].error_mm, models[i - 1].error_mm);
    EXPECT_LT(models[i].tick_ms, models[i - 1].tick_ms);
  }
  EXPECT_NE(models.front().kernel, "elastic");
}

Scene psi_scene() {
  Scene scene;
  scene.model.kernel = "psi31";
  return scene;
}

/// Scenes whose ticks take `cost_ms` of the kernel.
Diagnosis diagnosed(const Scene& scene, const std::function<double(const Scene&)>& cost_ms) {
  return diagnose(scene, [&](const Scene& tried) { return ticks_of(cost_ms(tried)); });
}

TEST(Doctor, ASceneThatFitsIsTriedOnce) {
  const Diagnosis d = diagnosed(psi_scene(), [](const Scene&) { return 1; });
  EXPECT_EQ(d.tried.size(), 1u);
  EXPECT_EQ(d.fit, 0u);
}

TEST(Doctor, KeepsTheModelWhereHalfTheRateWillDo) {
  const Diagnosis d = diagnosed(psi_scene(), [](const Scene&) { return 6; });
  ASSERT_TRUE(d.fit.has_value());
  EXPECT_EQ(d.tried[*d.fit].deformation_hz, 100);
  EXPECT_EQ(d.tried[*d.fit].kernel, "psi31");
}

TEST(Doctor, ElseTakesACheaperModelAtTheScenesRate) {
  Scene scene;
  scene.model.kernel = "elastic";
  const Diagnosis d = diagnosed(scene, [](const Scene& s) { return s.model.kernel == "elastic" ? 30 : 2; });
  ASSERT_TRUE(d.fit.has_value());
  EXPECT_EQ(d.tried[*d.fit].deformation_hz, 200);
  EXPECT_NE(d.tried[*d.fit].kernel, "elastic");
}

TEST(Doctor, AndWhereNoModelWillDoTheScenesOwnAsSlowAsItMustBe) {
  const Diagnosis d = diagnosed(psi_scene(), [](const Scene&) { return 30; });
  ASSERT_TRUE(d.fit.has_value());
  EXPECT_EQ(d.tried[*d.fit].deformation_hz, 20);
  EXPECT_EQ(d.tried[*d.fit].support_radius_mm, 12);
  EXPECT_FALSE(diagnosed(psi_scene(), [](const Scene&) { return 90; }).fit.has_value());
}

TEST(Doctor, AnswersInASentenceWithTheKeysThatAreToBeWritten) {
  const Scene scene = psi_scene();
  const Diagnosis heavy = diagnosed(scene, [](const Scene&) { return 6; });
  Machine machine;
  machine.period_s = scene.period_s();
  const std::string text = to_text(machine, scene, heavy);
  EXPECT_TRUE(
      text.starts_with("The scene is too heavy for this machine. psi31 (support 12 mm) at 200 Hz: a tick "
                       "takes 6.00 ms of 5.0 (p99), 0 of 1000 missed. This fits: psi31 (support 12 mm) "
                       "at 100 Hz: a tick takes 6.00 ms of 10.0 (p99), 0 of 1000 missed.\n"
                       "  in the scene:\n    [rates]\n    deformation_hz = 100\n"))
      << text;
  const auto json = nlohmann::json::parse(to_json(machine, scene, heavy));
  EXPECT_EQ(json.at("fits"), false);
  EXPECT_EQ(json.at("take").at("deformation_hz"), 100);
  EXPECT_EQ(json.at("take").at("kernel"), "psi31");
  EXPECT_EQ(json.at("take").at("support_radius_mm"), 12);
}

TEST(Doctor, SaysHowFarTheTissueLags) {
  const Scene scene = psi_scene();
  const Diagnosis late = diagnose(scene, [](const Scene&) {
    TrialResult result = ticks_of(1);
    result.late = 40;
    result.max_lag_mm = 0.354;
    return result;
  });
  const std::string text = to_text(Machine(), scene, late);
  EXPECT_NE(text.find("0 of 1000 missed, 40 late (tissue at most 0.35 mm behind)"), std::string::npos)
      << text;
  const auto tried = nlohmann::json::parse(to_json(Machine(), scene, late)).at("tried").at(0);
  EXPECT_EQ(tried.at("ticks_late"), 40);
  EXPECT_EQ(tried.at("max_lag_mm"), 0.354);
}

TEST(Doctor, EndsWithTheCostsOfWorkAsLinesForAScene) {
  Machine machine;
  machine.work_scale = 2;
  const Scene scene = psi_scene();
  const std::string text = to_text(machine, scene, diagnosed(scene, [](const Scene&) { return 1; }));
  const std::string words =
      "a tick's work costs 2.00 times what is stored; for scenes of this machine alone:\n";
  const std::size_t at = text.find(words);
  ASSERT_NE(at, std::string::npos) << text;
  const Scene pasted = parse_scene(text.substr(at + words.size()), "pasted");
  EXPECT_EQ(pasted.work_costs.system_s, 4e-4);
  EXPECT_EQ(pasted.work_costs.landmark_s, 8e-6);
  EXPECT_EQ(pasted.work_costs.landmark_pair_s, 3e-7);
  EXPECT_EQ(pasted.work_costs.step_s, 2.2e-4);
  EXPECT_EQ(pasted.work_costs.certificate_pair_s, 5e-8);
  EXPECT_EQ(pasted.work_costs.block_ring_steps_per_s, 2.6e7);
}

TEST(Doctor, SaysWhereTheMachineIsToBlame) {
  Machine busy;
  busy.period_s = 0.005;
  for (int i = 0; i < 100; ++i) busy.lateness_ns.record(2'000'000);
  const Diagnosis heavy = diagnosed(psi_scene(), [](const Scene&) { return 6; });
  EXPECT_NE(
      to_text(busy, psi_scene(), heavy)
          .find("wakes even an idle thread 2.0 ms late (p99): free it of other work, or set [realtime]"),
      std::string::npos);
}

TEST(Doctor, DoesNotJudgeASceneOnABusyMachine) {
  // 237 of 2,008 ticks missed, and an idle thread missed nearly as many: neither "fits" nor "too heavy" follows.
  for (const double cost_ms : {1., 6.}) {
    int trials = 0;
    const Diagnosis busy = diagnose(psi_scene(), [&](const Scene&) {
      ++trials;
      return ticks_of(cost_ms, 118, 112);
    });
    EXPECT_EQ(trials, 1) << "another model or rate would not be judged either";
    EXPECT_FALSE(busy.fit.has_value());
    const std::string text = to_text(Machine(), psi_scene(), busy);
    EXPECT_TRUE(
        text.starts_with("This machine is busy: cannot judge. Even an idle thread missed 112 of 1000"))
        << text;
    EXPECT_EQ(text.find("fits"), std::string::npos) << text;
    const auto json = nlohmann::json::parse(to_json(Machine(), psi_scene(), busy));
    EXPECT_EQ(json.at("fits"), false);
    EXPECT_EQ(json.at("busy"), true);
    EXPECT_TRUE(json.at("take").is_null());
  }
  EXPECT_FALSE(is_busy(ticks_of(1, 12, 10))) << "one in a hundred";
}

TEST(Doctor, OfTheRealDaemonSaysWhatItMeasured) {
  TempFolder folder;
  const std::string scene = folder.write("scene.toml", small_scene());
  const Ended ended = run_brachyd({"doctor", "--config", scene, "--seconds", "0.5", "--json"});
  const auto json = json_of(ended);
  ASSERT_FALSE(json.is_discarded()) << ended.out << ended.err;
  // Whether it fits depends on the machine, which may be busy.
  EXPECT_TRUE(exited(ended, json.at("fits").get<bool>() ? 0 : 1));
  EXPECT_GE(json.at("machine").at("cores").get<int>(), 1);
  EXPECT_GT(json.at("machine").at("work_scale").get<double>(), 0);
  EXPECT_GT(json.at("machine").at("wakeup_lateness_ms").at("max").get<double>(), 0);
  EXPECT_EQ(json.at("machine").at("sched_fifo").at("granted").get<bool>(),
            json.at("machine").at("sched_fifo").at("refusal").get<std::string>().empty());
  EXPECT_EQ(json.at("scene").at("points"), 3000);
  const auto& own = json.at("tried").at(0);
  EXPECT_EQ(own.at("kernel"), "psi31");
  EXPECT_EQ(own.at("deformation_hz"), 200);
  EXPECT_GT(own.at("ticks").get<int>(), 0);
  EXPECT_GT(own.at("tick_ms").at("p99").get<double>(), 0);
  EXPECT_EQ(own.at("ticks_late"), 0) << "psi31 evaluates every tick whole";
  EXPECT_EQ(own.at("max_lag_mm"), 0);
}

TEST(Doctor, RefusesABadSceneAsTheDaemonDoes) {
  TempFolder folder;
  const std::string scene = folder.write("scene.toml", small_scene("prot = 1\n"));
  EXPECT_TRUE(refused_in_one_line(run_brachyd({"doctor", "--config", scene}), {scene + ":6", "server.prot"}));
  EXPECT_TRUE(refused_in_one_line(run_brachyd({"doctor", "--config", "/none.toml"}), {"no such scene file"}));
}

}  // namespace
}  // namespace brachy
