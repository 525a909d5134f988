// What a viewer is shown of states that no simulation needs to reach: a server in this process, the tool outside.
#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <limits>

#include "net/server.h"
#include "tests/apps/apps_testing.h"

namespace brachy {
namespace {

using namespace test;

Tissue one_triangle() {
  Tissue tissue;
  tissue.surface_count = 3;
  tissue.rest_vertices = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  tissue.triangles = {{0, 1, 2}};
  tissue.blocks = {{0, 3, {0, 0, 0}, {10, 10, 0}}};
  return tissue;
}

/// Serves one `brachy watch` the states it is given, none left out.
class WatchedStates {
 public:
  explicit WatchedStates(const std::vector<std::string>& more = {})
      : server_(io_, net::ServerOptions{}, one_triangle(), handlers()), watch_(line(more)) {
    const auto deadline = std::chrono::steady_clock::now() + ChildProcess::kDeadline;
    while (!joined_ && std::chrono::steady_clock::now() < deadline)
      io_.run_one_for(std::chrono::milliseconds(50));
    EXPECT_TRUE(joined_);
  }

  template <class Change>
  void show(Change&& change) {
    MeshState state;
    state.tick = ++tick_;
    state.deformed_vertices = {0, 0, 0, 10, 0, 0, 0, 10, 0};
    state.block_ticks = {tick_};
    change(state);
    server_.publish(std::make_shared<const MeshState>(std::move(state)));
    serve();
  }
  void tell(const std::string& warning) {
    server_.broadcast({net::EventKind::kWarning, 0, tick_, warning});
    serve();
  }

  Ended end() {
    server_.stop();
    io_.restart();
    io_.run();
    return watch_.wait();
  }

 private:
  net::ServerHandlers handlers() {
    net::ServerHandlers h;
    h.log = [this](const std::string& text) { joined_ |= text.ends_with("joined"); };
    return h;
  }
  std::vector<std::string> line(const std::vector<std::string>& more) const {
    auto arguments = brachy_line({"watch", "--connect", "127.0.0.1:" + std::to_string(server_.port())});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  // Until nothing is ready: frames of three points leave at once, so that none is replaced by a newer one.
  void serve() {
    io_.restart();
    while (io_.poll() > 0) {
    }
  }

  boost::asio::io_context io_{1};
  bool joined_ = false;
  std::uint64_t tick_ = 0;
  net::Server server_;
  ChildProcess watch_;
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
