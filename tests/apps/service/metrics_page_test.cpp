#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "apps/daemon/service/loop_pulse.h"
#include "apps/daemon/telemetry/exposition.h"
#include "net/access/token_file.h"
#include "tests/apps/http_get.h"
#include "tests/apps/peer.h"

namespace brachy {
namespace {

using namespace test;

/// The samples by name with labels, as a scraper parses them. Fails the test where Prometheus would reject the text.
std::map<std::string, double> samples_of(const std::string& text) {
  std::map<std::string, double> samples;
  std::set<std::string> families;
  std::string family, type;
  EXPECT_TRUE(text.ends_with('\n'));
  for (const std::string& line : lines_of(text)) {
    if (line.starts_with("# HELP ")) {
      family = line.substr(7, line.find(' ', 7) - 7);
      EXPECT_TRUE(families.insert(family).second) << "twice: " << family;
      EXPECT_TRUE(line.ends_with('.')) << line;
      continue;
    }
    if (line.starts_with("# TYPE ")) {
      EXPECT_TRUE(line.starts_with("# TYPE " + family + " ")) << line;
      type = line.substr(line.rfind(' ') + 1);
      EXPECT_EQ(type == "counter", family.ends_with("_total")) << line;
      EXPECT_TRUE(type == "counter" || type == "gauge" || type == "histogram") << line;
      continue;
    }
    const std::size_t space = line.rfind(' ');
    const std::string name = line.substr(0, std::min(line.find('{'), space));
    if (type == "histogram")
      EXPECT_TRUE(name == family + "_bucket" || name == family + "_sum" || name == family + "_count") << line;
    else
      EXPECT_EQ(name, family) << line;
    double value = 0;
    const auto parsed = std::from_chars(line.data() + space + 1, line.data() + line.size(), value);
    EXPECT_EQ(parsed.ptr, line.data() + line.size()) << line;
    EXPECT_TRUE(samples.emplace(line.substr(0, space), value).second) << "twice: " << line;
  }
  return samples;
}

TEST(Exposition, WritesHelpTypeAndSamplesWithTheirLabelsEscaped) {
  Exposition out;
  out.counter("a_total", 3, "Of a.");
  out.family("b", "gauge", "Of b.");
  out.sample(0.5, {{"x", "a\"b\\c\nd"}, {"y", ""}});
  EXPECT_EQ(out.take(),
            "# HELP a_total Of a.\n# TYPE a_total counter\na_total 3\n"
            "# HELP b Of b.\n# TYPE b gauge\nb{x=\"a\\\"b\\\\c\\nd\",y=\"\"} 0.5\n");
}

TEST(Exposition, HistogramsAreInSecondsAndCumulative) {
  Histogram ns;
  for (const std::int64_t ms : {1, 3, 3, 20, 900}) ns.record(1'000'000 * ms);
  Exposition out;
  out.histogram("h_seconds", ns, "Of h.");
  const auto samples = samples_of(out.take());
  EXPECT_EQ(samples.at("h_seconds_bucket{le=\"0.0005\"}"), 0);
  EXPECT_EQ(samples.at("h_seconds_bucket{le=\"0.0025\"}"), 1);
  EXPECT_EQ(samples.at("h_seconds_bucket{le=\"0.005\"}"), 3);
  EXPECT_EQ(samples.at("h_seconds_bucket{le=\"0.25\"}"), 4);
  EXPECT_EQ(samples.at("h_seconds_bucket{le=\"+Inf\"}"), 5);
  EXPECT_DOUBLE_EQ(samples.at("h_seconds_sum"), 0.927);
  EXPECT_EQ(samples.at("h_seconds_count"), 5);
}

TEST(LoopPulse, StandsStillAfterTenPeriodsAndNoLessThanASecond) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  LoopPulse quick(0.005, 0), slow(0.5, 0);
  EXPECT_EQ(quick.failure(kSecond), "");
  EXPECT_NE(quick.failure(kSecond + 1), "");
  EXPECT_EQ(slow.failure(5 * kSecond), "");
  EXPECT_EQ(slow.failure(7 * kSecond), "the deformation loop has not ticked for 7.0 s");
  EXPECT_FALSE(quick.has_ticked());
  quick.on_tick(2 * kSecond);
  EXPECT_TRUE(quick.has_ticked());
  EXPECT_FALSE(quick.has_ticked()) << "not again";
  EXPECT_EQ(quick.failure(3 * kSecond), "");
}

/// On a busy machine the loop may have stood still for a second.
bool tells_health(const std::string& reply) {
  return reply.starts_with("HTTP/1.1 200 ") ||
         body_of(reply).starts_with("the deformation loop has not ticked");
}

struct BrachydMetrics : ::testing::Test {
  TempFolder folder;
};

TEST_F(BrachydMetrics, TellWhatTheDaemonDoesAsPrometheusReadsIt) {
  RunningBrachyd daemon(folder.write("scene.toml", small_scene("http_port = 0\n")));
  const std::uint16_t port = http_port(daemon);
  ASSERT_NE(port, 0);
  Peer viewer, device(net::Role::kDevice);
  ASSERT_TRUE(viewer.join(daemon.port));
  ASSERT_TRUE(device.join(daemon.port));
  ASSERT_TRUE(viewer.until([&] { return viewer.frames.size() > 2; }));
  device.client.send_pose({Mat3::Identity(), Vec3(std::nan(""), 0, 0)}, monotonic_ns());
  ASSERT_TRUE(device.until([&] { return !device.errors.empty(); }));

  std::string reply;  // the loop publishes statistics every twenty ticks
  ASSERT_TRUE(viewer.until([&] {
    reply = http_get(port, "/metrics");
    return reply.find("\nbrachy_ticks_total 0\n") == std::string::npos;
  }));
  EXPECT_TRUE(reply.starts_with("HTTP/1.1 200 OK\r\n")) << reply;
  EXPECT_NE(reply.find("Content-Type: text/plain; version=0.0.4; charset=utf-8\r\n"), std::string::npos);
  EXPECT_NE(reply.find("Cache-Control: no-store\r\n"), std::string::npos);
  auto now = samples_of(body_of(reply));
  EXPECT_GT(now.at("brachy_ticks_total"), 0);
  EXPECT_EQ(now.at("brachy_tick_seconds_count"), now.at("brachy_ticks_total"));
  EXPECT_EQ(now.at("brachy_tick_seconds_bucket{le=\"+Inf\"}"), now.at("brachy_ticks_total"));
  EXPECT_EQ(now.at("brachy_tick_period_seconds"), 0.005);
  EXPECT_TRUE(now.contains("brachy_ticks_missed_total"));
  EXPECT_EQ(now.at("brachy_clients{role=\"viewer\"}"), 1);
  EXPECT_EQ(now.at("brachy_clients{role=\"device\"}"), 1);
  EXPECT_EQ(now.at("brachy_clients{role=\"operator\"}"), 0);
  EXPECT_GE(now.at("brachy_snapshots_total"), 3);
  EXPECT_TRUE(now.contains("brachy_snapshots_dropped_total"));
  EXPECT_EQ(now.at("brachy_poses_accepted_total"), 0);
  EXPECT_EQ(now.at("brachy_poses_refused_total{reason=\"not_finite\"}"), 1);
  EXPECT_EQ(now.at("brachy_wrong_tokens_total"), 0);
  EXPECT_EQ(now.at("brachy_model_info{kernel=\"psi31\",support_radius_mm=\"12\"}"), 1);
  EXPECT_GT(now.at("process_resident_memory_bytes"), 1e6);
  EXPECT_GT(now.at("process_cpu_seconds_total"), 0);
  EXPECT_GT(now.at("process_open_fds"), 3);
  EXPECT_GT(now.at("process_start_time_seconds"), 1.6e9);
  EXPECT_EQ(
      std::ranges::count_if(now, [](const auto& s) { return s.first.starts_with("brachy_build_info{"); }), 1);
}

TEST_F(BrachydMetrics, TakeAViewersTokenWhereThereAreTokensAndHealthNone) {
  for (const char* name : {"viewer.token", "other.token"})
    ASSERT_TRUE(exited(run_brachy({"token", (folder / name).string()}), 0));
  RunningBrachyd daemon(
      folder.write("scene.toml", small_scene("http_port = 0\nviewer_token_file = \"viewer.token\"\n")));
  const std::uint16_t port = http_port(daemon);
  ASSERT_NE(port, 0);
  const auto with_token = [&](const char* name) {
    return "Authorization: Bearer " + net::to_hex(net::load_token(folder / name)) + "\r\n";
  };
  EXPECT_TRUE(tells_health(http_get(port, "/healthz")));
  const std::string none = http_get(port, "/metrics");
  EXPECT_TRUE(none.starts_with("HTTP/1.1 401 ")) << none;
  EXPECT_NE(none.find("WWW-Authenticate: Bearer"), std::string::npos) << none;
  EXPECT_TRUE(http_get(port, "/metrics", with_token("other.token")).starts_with("HTTP/1.1 401 "));
  EXPECT_TRUE(http_get(port, "/metrics", "Authorization: Bearer 12\r\n").starts_with("HTTP/1.1 401 "));
  const auto samples = samples_of(body_of(http_get(port, "/metrics", with_token("viewer.token"))));
  EXPECT_EQ(samples.at("brachy_wrong_tokens_total"), 1);
}

TEST_F(BrachydMetrics, AreToldWhereEveryPlaceIsTaken) {
  RunningBrachyd daemon(folder.write("scene.toml", small_scene("http_port = 0\nmax_clients = 1\n")));
  const std::uint16_t port = http_port(daemon);
  ASSERT_NE(port, 0);
  Peer viewer;
  ASSERT_TRUE(viewer.join(daemon.port));
  EXPECT_TRUE(http_get(port, "/").starts_with("HTTP/1.1 503 "));
  EXPECT_TRUE(tells_health(http_get(port, "/healthz")));
  EXPECT_GE(samples_of(body_of(http_get(port, "/metrics"))).at("brachy_connections_refused_total"), 2);
}

}  // namespace
}  // namespace brachy
