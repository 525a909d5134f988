#pragma once

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "net/server/server.h"
#include "tests/apps/apps_testing.h"

namespace brachy::test {

/// A server in this process that publishes arbitrary states, and tool processes that follow it.
class ServedStates {
 public:
  ServedStates() : server_(io_, net::ServerOptions{}, one_triangle(), handlers()) {}

  /// Starts `brachy COMMAND… --connect … MORE…` and waits until it has joined.
  ChildProcess& start(std::vector<std::string> command, const std::vector<std::string>& more = {}) {
    return start_line(brachy_line(std::move(command)), more);
  }
  ChildProcess& start_line(std::vector<std::string> line, const std::vector<std::string>& more = {},
                           ChildProcess::Output output = {}) {
    line.insert(line.end(), {"--connect", address()});
    line.insert(line.end(), more.begin(), more.end());
    tools_.push_back(std::make_unique<ChildProcess>(line, output));
    const std::size_t awaited = joined_ + 1;
    EXPECT_TRUE(wait_until([&] { return joined_ == awaited; }, [&] { io_.run_one_for(kTurn); }));
    return *tools_.back();
  }

  /// Publishes the next tick's state, after `change`.
  template <class Change>
  void show(Change&& change) {
    MeshState state;
    state.summary.tick = ++tick_;
    state.summary.sim_time_s = 0.005 * static_cast<double>(tick_);
    state.mesh.deformed_vertices = {0, 0, 0, 10, 0, 0, 0, 10, 0};
    state.mesh.block_ticks = {tick_};
    change(state);
    tick_ = state.summary.tick;
    server_.publish(std::make_shared<const MeshState>(std::move(state)));
    serve();
  }
  void tell(const std::string& warning) { tell({net::EventKind::kWarning, 0, tick_, warning}); }
  void tell(const net::EventMessage& event) {
    server_.broadcast(event);
    serve();
  }
  /// Until nothing is ready: frames of three points leave at once, so that none is replaced by a newer one.
  void serve() {
    io_.restart();
    while (io_.poll() > 0) {
    }
  }

  /// Stops the server and waits for the tools, in the order they were started.
  std::vector<Ended> end() {
    server_.stop();
    io_.restart();
    io_.run();
    std::vector<Ended> ended;
    for (const auto& tool : tools_) ended.push_back(tool->wait());
    return ended;
  }

  std::string address() const { return "127.0.0.1:" + std::to_string(server_.port()); }
  std::uint64_t tick() const { return tick_; }
  net::Server& server() { return server_; }

 private:
  static Tissue one_triangle() {
    Tissue tissue;
    tissue.surface_count = 3;
    tissue.rest_vertices = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
    tissue.triangles = {{0, 1, 2}};
    tissue.blocks = {{0, 3, {0, 0, 0}, {10, 10, 0}}};
    return tissue;
  }
  net::ServerHandlers handlers() {
    net::ServerHandlers h;
    h.log = [this](const std::string& text) { joined_ += text.ends_with("joined"); };
    return h;
  }

  boost::asio::io_context io_{1};
  std::size_t joined_ = 0;
  std::uint64_t tick_ = 0;
  net::Server server_;
  std::vector<std::unique_ptr<ChildProcess>> tools_;
};

}  // namespace brachy::test
