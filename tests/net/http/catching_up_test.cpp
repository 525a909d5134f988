// Pages that join late, read slowly, sleep, are closed and reconnect: each has the simulator's mesh again within one
// full frame, and the server holds at most one frame in transit for each. Time is counted in snapshots: a page reads
// a number of bytes for each, and nothing waits for a clock.
#include <malloc.h>

#include <algorithm>
#include <span>

#include "net/transport/tcp/tcp_socket.h"
#include "tests/net/transport/tls/tls_fixture.h"

namespace brachy::net::test {
namespace {

constexpr std::size_t kSurface = 1200, kPoints = 14'560;
constexpr std::size_t kOneMegabit = 1'000'000 / 8 / 30;  // bytes for each of 30 snapshots a second
constexpr int kReceiveBuffer = 4096;                     // the page's, so that it holds little itself

std::size_t heap_bytes() {
  const auto info = ::mallinfo2();
  return info.uordblks + info.hblkhd;
}

/// The pages of a test.
struct Pages {
  const char* name;
  bool is_surface = false, has_tls = false;
};

struct CatchingUp : TlsFixture, ::testing::WithParamInterface<Pages> {
  /// The default scene's counts of points.
  void begin(ServerOptions options = {}) {
    tissue = line_tissue(kPoints / 5);
    tissue.surface_count = kSurface;
    simulation = FakeSimulation(tissue);
    if (GetParam().has_tls) {
      options.tls = server_context();
      tls = client_context();
    }
    start_http(options);
  }
  /// Six ticks later; the server has processed everything.
  void next_snapshot() {
    simulation.steps(6);
    auto snapshot = simulation.snapshot();
    std::erase_if(snapshots, [](const auto& old) { return old.expired(); });
    snapshots.push_back(snapshot);
    server->publish(std::move(snapshot));
    io.poll();
  }
  void next_snapshots(int count) {
    for (int i = 0; i < count; ++i) next_snapshot();
  }
  std::unique_ptr<WebSocketPeer> sleeping_page() {
    auto page = open_page(kReceiveBuffer);
    log.clear();
    page->hello(Role::kViewer, subscription());
    EXPECT_TRUE(until([&] { return !log.empty(); }));
    EXPECT_NE(log.at(0).find("joined"), std::string::npos);
    return page;
  }
  bool catches_up(WebSocketPeer& page) {
    return until_at_once([&] {
      page.take();
      return page.mesh.tick() == simulation.state().summary.tick;
    });
  }
  /// Bit for bit.
  bool has_the_mesh(const WebSocketPeer& page) const {
    const auto& all = simulation.state().mesh.deformed_vertices;
    const std::span expected(all.data(), is_surface() ? 3 * kSurface : all.size());
    return std::ranges::equal(page.mesh.positions(), expected);
  }
  /// Those that are still referenced.
  std::size_t held_snapshots() const {
    return static_cast<std::size_t>(std::count_if(snapshots.begin(), snapshots.end(),
                                                  [](const auto& snapshot) { return !snapshot.expired(); }));
  }

  /// One in transit, one pending, and whole ones in the buffers of the two sockets: up to the mark, and one beyond it.
  static std::size_t frames_behind(const WebSocketPeer& page) {
    // the kernel doubles what it is asked for
    constexpr std::size_t kInSockets = kMaxUnsentBytes + 2 * kReceiveBuffer;
    return 3 + kInSockets / page.frame_bodies.back().size();
  }

  bool is_surface() const { return GetParam().is_surface; }
  std::uint32_t subscription() const { return is_surface() ? std::uint32_t{kSubscribeSurface} : 0; }
  std::size_t mesh_bytes() const { return 12 * (is_surface() ? kSurface : kPoints); }

  std::vector<std::weak_ptr<const MeshState>> snapshots;
};

TEST_P(CatchingUp, APageThatJoinsLateHasTheMeshAfterItsFirstFrame) {
  begin();
  next_snapshots(100);
  const auto page = join_page(Role::kViewer, subscription());
  ASSERT_TRUE(until([&] {
    page->take();
    return !page->frames.empty();
  }));
  EXPECT_TRUE(page->frames[0].full);
  EXPECT_EQ(page->frames[0].tick, simulation.state().summary.tick);
  EXPECT_TRUE(has_the_mesh(*page));
  EXPECT_LT(page->frame_bodies[0].size(), mesh_bytes() + 1024);
}

TEST_P(CatchingUp, APageAtOneMegabitASecondIsBehindByWhatIsOnItsWayAndOneFrame) {
  begin();
  next_snapshot();
  const auto page = sleeping_page();
  std::vector<std::uint64_t> newest;  // tick when each frame had come
  std::size_t allowance = 0;
  for (int i = 0; i < 600; ++i) {  // 20 s at 30 Hz
    next_snapshot();
    allowance += kOneMegabit;
    std::size_t taken = 1;
    while (allowance > 0 && taken > 0) {
      allowance -= taken = page->take(allowance);
      newest.resize(page->frames.size(), simulation.state().summary.tick);
      io.poll();
    }
  }
  const std::size_t slow_frames = page->frames.size();
  ASSERT_GT(slow_frames, 8u);
  EXPECT_LT(slow_frames, 600u);  // most were dropped
  EXPECT_LE(held_snapshots(), 2u);
  EXPECT_TRUE(page->frames[0].full);
  for (std::size_t i = 1; i < slow_frames; ++i) {
    EXPECT_FALSE(page->frames[i].full);
    EXPECT_EQ(page->frames[i].base_tick,
              page->frames[i - 1].tick);  // what it holds, whatever was dropped between
    // Made when the last one had left the server; between there and here is what the two sockets hold.
    if (i >= 3) {
      EXPECT_GE(page->frames[i].tick, newest[i - 3]) << i;
    }
  }

  ASSERT_TRUE(catches_up(*page));
  EXPECT_LE(page->frames.size(), slow_frames + frames_behind(*page));
  EXPECT_TRUE(has_the_mesh(*page));
  page->states.clear();
  ASSERT_TRUE(until([&] {
    page->take();
    return !page->states.empty();
  }));
  EXPECT_EQ(page->states[0].snapshots_sent, page->frames.size());
  EXPECT_EQ(page->states[0].snapshots_sent + page->states[0].snapshots_dropped, 601u);
}

TEST_P(CatchingUp, APageThatSleptGetsWhatIsOnItsWayAndOneFrameMore) {
  begin();
  next_snapshot();
  const auto page = sleeping_page();
  ASSERT_TRUE(catches_up(*page));
  const std::size_t frames = page->frames.size();
  next_snapshots(300);  // it reads nothing
  EXPECT_EQ(page->frames.size(), frames);
  EXPECT_LE(held_snapshots(), 2u);
  ASSERT_TRUE(catches_up(*page));
  EXPECT_TRUE(has_the_mesh(*page));
  EXPECT_LE(page->frames.size(), frames + frames_behind(*page));
  for (std::size_t i = frames; i < page->frames.size(); ++i)
    EXPECT_EQ(page->frames[i].base_tick, page->frames[i - 1].tick);
}

TEST_P(CatchingUp, APageThatSleptWhileTheSimulationBeganAnewGetsAFullFrame) {
  begin();
  next_snapshots(20);
  const auto page = sleeping_page();
  ASSERT_TRUE(catches_up(*page));
  next_snapshots(20);
  simulation = FakeSimulation(tissue, 2);
  next_snapshot();
  ASSERT_TRUE(catches_up(*page));
  EXPECT_EQ(page->mesh.tick(), 6u);
  EXPECT_TRUE(page->frames.back().full);
  EXPECT_TRUE(has_the_mesh(*page));
}

TEST_P(CatchingUp, PagesThatSleepForGoodAreClosedAndTakeNoMoreMemoryMeanwhile) {
  ServerOptions options;
  options.stall_timeout = std::chrono::milliseconds(1000);
  begin(options);
  next_snapshot();
  std::vector<std::unique_ptr<WebSocketPeer>> asleep;
  for (int i = 0; i < 16; ++i) asleep.push_back(sleeping_page());
  next_snapshots(10);
  const std::size_t before = heap_bytes();
  for (int i = 0; i < 200; ++i) {
    next_snapshot();
    ASSERT_LE(held_snapshots(), 2u);
    ASSERT_LT(heap_bytes(), before + 2 * 12 * kPoints)
        << i;  // the newest snapshot's own memory, and a frame of it
  }
  ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
  EXPECT_NE(log.back().find("did not read for 1 s"), std::string::npos) << log.back();
  EXPECT_LT(heap_bytes(), before + 12 * kPoints);

  asleep.clear();
  next_snapshot();
  const auto back = join_page(Role::kViewer, subscription());
  ASSERT_TRUE(catches_up(*back));
  EXPECT_EQ(back->frames.size(), 1u);
  EXPECT_TRUE(back->frames[0].full);
  EXPECT_TRUE(has_the_mesh(*back));
}

TEST_P(CatchingUp, PagesThatComeAndGoInTheMiddleOfAFrameLeaveNothingBehind) {
  begin();
  next_snapshot();
  std::size_t after_ten = 0;
  for (int i = 0; i < 60; ++i) {
    const auto page = sleeping_page();
    next_snapshot();
    page->take(5000);
    page->close();
    ASSERT_TRUE(until([&] { return server->client_count() == 0; }));
    if (i == 10) after_ten = heap_bytes();
  }
  EXPECT_LT(heap_bytes(), after_ten + 12 * kPoints);
  EXPECT_LE(held_snapshots(), 2u);
  const auto page = join_page(Role::kViewer, subscription());
  ASSERT_TRUE(catches_up(*page));
  EXPECT_TRUE(has_the_mesh(*page));
}

INSTANTIATE_TEST_SUITE_P(VolumeAndSurface, CatchingUp,
                         ::testing::Values(Pages{"Volume"}, Pages{"Surface", true},
                                           Pages{"VolumeOverTls", false, true}),
                         [](const auto& pages) { return pages.param.name; });

}  // namespace
}  // namespace brachy::net::test
