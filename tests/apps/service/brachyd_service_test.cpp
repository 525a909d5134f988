// brachyd as a service: its notifications, the watchdog, and the health page.
#include <fcntl.h>

#include <algorithm>
#include <csignal>

#include "tests/apps/http_get.h"
#include "tests/apps/peer.h"
#include "tests/apps/service/notify_socket.h"
#include "tests/apps/service/stopped_thread.h"

namespace brachy {
namespace {

using namespace test;

struct BrachydService : ::testing::Test {
  TempFolder folder;
  std::string scene = folder.write("scene.toml", small_scene());
  NotifySocket manager{folder / "notify"};

  std::vector<std::string> with_manager(const std::string& more = "BRACHY=") const {
    return {"/usr/bin/env", manager.variable(), more};
  }
  template <class Condition>
  static bool until(Condition&& condition) {
    return wait_until(condition, [] {});
  }
};

TEST_F(BrachydService, SaysWhenItListensAndWhenItEnds) {
  RunningBrachyd daemon(scene, {}, with_manager());
  ASSERT_TRUE(manager.hears("READY=1"));
  EXPECT_NE(manager.messages.back().find("STATUS=" + daemon.address), std::string::npos);
  Peer viewer;
  EXPECT_TRUE(viewer.join(daemon.port));
  EXPECT_EQ(manager.count_new("WATCHDOG=1"), 0) << "nobody asked for it";
  daemon.process.send_signal(SIGTERM);
  EXPECT_TRUE(manager.hears("STOPPING=1"));
  EXPECT_TRUE(exited(daemon.process.wait(), 0));
}

TEST_F(BrachydService, AStuckLoopStarvesTheWatchdogAndIsNotHealthyAlthoughAllElseGoesOn) {
  RunningBrachyd daemon(scene, {"--http-port", "0"}, with_manager("WATCHDOG_USEC=200000"));
  const std::uint16_t port = http_port(daemon);
  ASSERT_NE(port, 0);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_NE(manager.messages.back().find("ticks, "), std::string::npos) << manager.messages.back();
  EXPECT_TRUE(until([&] { return http_get(port, "/healthz").starts_with("HTTP/1.1 200 OK\r\n"); }));

  StoppedThread loop(daemon.process.pid(), "deformation");
  ASSERT_TRUE(loop.is_found());
  if (!loop.is_stopped()) GTEST_SKIP() << "this system lets nobody trace a process";
  manager.count_new("");
  std::string reply;
  int fed = 0;  // counted all the time: a reader that stalls could block the sender
  ASSERT_TRUE(until([&] {
    fed += manager.count_new("WATCHDOG=1");
    return (reply = http_get(port, "/healthz")).starts_with("HTTP/1.1 503 ");
  }));
  EXPECT_NE(body_of(reply).find("the deformation loop has not ticked for "), std::string::npos) << reply;
  // In one second the watchdog could be fed twenty times; it is fed once, for ticks before the loop was stopped.
  EXPECT_LE(fed + manager.count_new("WATCHDOG=1"), 1);

  loop.go_on();
  EXPECT_TRUE(manager.hears("WATCHDOG=1"));
  EXPECT_TRUE(until([&] { return body_of(http_get(port, "/healthz")) == "ok\n"; }));
}

TEST_F(BrachydService, ALogThatNobodyReadsHoldsNothingUp) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  FileDescriptor read_end(ends[0]), write_end(ends[1]);
  fcntl(read_end.get(), F_SETFL, O_NONBLOCK);
  fcntl(write_end.get(), F_SETFL, O_NONBLOCK);
  const std::string filler(4096, '.');
  while (write(write_end.get(), filler.data(), filler.size()) > 0) {
  }
  fcntl(write_end.get(), F_SETFL, 0);
  ChildProcess daemon(brachyd_line({"--config", scene, "--port", "0", "--duration", "60", "--json"}),
                      {.err = write_end.get()});
  const auto first = daemon.read_line();
  ASSERT_TRUE(first && first->starts_with("{\"listening_on\":\"127.0.0.1:"));
  const auto port = static_cast<std::uint16_t>(std::stoi(first->substr(first->rfind(':') + 1)));
  {
    Peer viewer;
    ASSERT_TRUE(viewer.join(port));
    EXPECT_TRUE(viewer.until([&] { return viewer.frames.size() > 3; }));
  }
  std::string told;
  {
    Peer device(net::Role::kDevice);
    ASSERT_TRUE(device.join(port));
    device.client.send_pose({}, monotonic_ns());  // and then none
    ASSERT_TRUE(device.until([&] {
      const auto event = std::ranges::find(device.events, net::EventKind::kSafety, &net::EventMessage::kind);
      if (event != device.events.end()) told = event->text;
      return !told.empty();
    }));
  }
  std::string log;  // read at the end
  std::string piece(65536, '\0');
  const auto read_all = [&] {
    for (ssize_t size = 0; (size = read(read_end.get(), piece.data(), piece.size())) > 0;)
      log.append(piece.data(), static_cast<std::size_t>(size));
  };
  ASSERT_TRUE(until([&] {
    read_all();
    return log.find(" safety: " + told + "\n") != std::string::npos;
  })) << told;
  Peer late;
  ASSERT_TRUE(late.join(port));
  ASSERT_TRUE(until([&] {
    read_all();
    return log.find("lines of the log dropped: its reader stalled\n") != std::string::npos &&
           log.find("joined\n") != std::string::npos;
  })) << log.substr(log.find_first_not_of('.'));
  daemon.send_signal(SIGTERM);
  const Ended ended = daemon.wait();
  EXPECT_TRUE(exited(ended, 0));
  EXPECT_FALSE(json_of(ended).is_discarded()) << ended.out;
}

}  // namespace
}  // namespace brachy
