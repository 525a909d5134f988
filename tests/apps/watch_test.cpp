// What a viewer is shown of states that no simulation needs to reach: a server in this process, the tool outside.
#include <gtest/gtest.h>

#include <limits>

#include "tests/apps/served_states.h"

namespace brachy {
namespace {

using namespace test;

struct WatchedStates : ServedStates {
  explicit WatchedStates(std::vector<std::string> more = {}) { start({"watch"}, std::move(more)); }
  Ended end() { return ServedStates::end().front(); }
};

void show_one_of_each(WatchedStates& states) {
  states.show([](MeshState&) {});
  states.show([](MeshState& s) {
    s.step_flags = kStepSubstepped | kStepClamped;
    s.certificate.det_bound = 0.25;
    s.certificate.vertex_det = 0.5;
    s.certificate.substeps = 3;
    s.certificate.held_mm = 2.125;
    s.certificate.condition = 2000;
  });
  states.show([](MeshState& s) {
    s.step_flags = kStepFolded;
    s.certificate.verdict = Verdict::kFolded;
    s.certificate.det_bound = Certificate::kNotKnown;
    s.certificate.vertex_det = -0.5;
  });
  states.show([](MeshState& s) {
    s.step_flags = kStepUncertified;
    s.certificate.verdict = Verdict::kUnknown;
    s.certificate.det_bound = Certificate::kNotKnown;
    s.certificate.vertex_det = Certificate::kNotKnown;
  });
}

TEST(Watch, CountsFramesByVerdictAndByGuard) {
  WatchedStates states({"--json"});
  show_one_of_each(states);
  const Ended ended = states.end();
  ASSERT_TRUE(exited(ended, 0));
  const auto json = json_of(ended);
  ASSERT_FALSE(json.is_discarded()) << ended.out;
  EXPECT_EQ(json.at("snapshots"), 4);
  EXPECT_EQ(json.at("frames_injective"), 2);
  EXPECT_EQ(json.at("frames_folded"), 1);
  EXPECT_EQ(json.at("frames_unknown"), 1);
  EXPECT_EQ(json.at("frames_unflagged"), 0);
  EXPECT_EQ(json.at("frames_substepped"), 1);
  EXPECT_EQ(json.at("frames_clamped"), 1);
  EXPECT_EQ(json.at("min_det_bound"), 0.25);
  EXPECT_EQ(json.at("min_vertex_det"), -0.5);
  EXPECT_EQ(json.at("max_substeps"), 3);
  EXPECT_EQ(json.at("max_held_mm"), 2.125);
  EXPECT_EQ(json.at("max_condition"), 2000);
  EXPECT_EQ(json.at("nonfinite"), 0);
}

TEST(Watch, CountsWhatMustNotBe) {
  WatchedStates states({"--json"});
  states.show([](MeshState& s) { s.certificate.verdict = Verdict::kFolded; });  // and no flag says so
  states.show([](MeshState& s) { s.deformed_vertices[8] = std::numeric_limits<float>::quiet_NaN(); });
  states.show([](MeshState& s) { s.deformed_vertices[0] = std::numeric_limits<float>::infinity(); });
  const auto json = json_of(states.end());
  ASSERT_FALSE(json.is_discarded());
  EXPECT_EQ(json.at("frames_unflagged"), 1);
  EXPECT_EQ(json.at("nonfinite"), 2);
}

TEST(Watch, TellsPeopleTheSame) {
  WatchedStates states;
  show_one_of_each(states);
  states.tell("field folds at (1.0, 2.0, 3.0) mm");
  const Ended ended = states.end();
  ASSERT_TRUE(exited(ended, 0));
  for (const char* part :
       {"frames: 2 injective, 1 folded, 1 unknown; least det: bound 0.250, at vertices -0.500",
        "1 with sub-steps (at most 3), 1 held back (at most 2.12 mm)",
        "tick 4: field folds at (1.0, 2.0, 3.0) mm"})
    EXPECT_NE(ended.out.find(part), std::string::npos) << part << "\n" << ended.out;
}

}  // namespace
}  // namespace brachy
