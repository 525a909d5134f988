// The client of scripts/conformance/README.md on net/client: HOST PORT ROLE [TOKEN]. Prints what it receives.

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "net/access/token_file.h"
#include "net/client/client.h"

namespace {

using namespace brachy;
using nlohmann::json;

void say(const char* key, const json& value) {
  std::cout << json{{key, value}}.dump() << std::endl;
}

std::string hex(std::uint64_t value) {
  char digits[17];
  std::snprintf(digits, sizeof digits, "%016llx", static_cast<unsigned long long>(value));
  return digits;
}

/// 64-bit FNV-1a over the points' bytes, which are little-endian on the machines that we know.
std::uint64_t checksum(const std::vector<float>& positions) {
  std::uint64_t value = 0xcbf29ce484222325;
  for (const std::byte byte : std::as_bytes(std::span(positions)))
    value = (value ^ std::to_integer<std::uint64_t>(byte)) * 0x100000001b3;
  return value;
}

/// The tracker's pose number k: a straight needle; in some of them it has lost the needle.
RigidTransform track(int k) {
  RigidTransform X_WN;
  const bool is_lost = k % 50 == 10 || k % 50 == 11;
  X_WN.p = Vec3(is_lost ? std::numeric_limits<double>::quiet_NaN() : 5, 0, -30 + 0.25 * std::min(k, 240));
  return X_WN;
}

class ConformanceClient {
 public:
  explicit ConformanceClient(net::ClientOptions options)
      : timer_(net::real_clock().make_timer(io_)),
        is_device_(options.role == net::Role::kDevice),
        client_(io_, std::move(options), handlers()) {}

  void run(const std::string& host, std::uint16_t port) {
    client_.connect(host, port);
    io_.run();
  }

 private:
  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage& welcome) {
      say("welcome", {{"role", welcome.role}, {"needle", welcome.needle}, {"server", welcome.server}});
      if (welcome.max_poses_per_s > 0)
        interval_ = std::max(interval_, std::chrono::nanoseconds(1'000'000'000 / welcome.max_poses_per_s));
      if (is_device_) send_poses();
    };
    h.on_topology = [](const net::TopologyMessage& topology) {
      say("topology", {{"hash", hex(topology.hash)},
                       {"points", topology.rest_vertices.size() / 3},
                       {"triangles", topology.triangles.size()}});
    };
    h.on_frame = [this](const net::FrameMessage& frame) {
      say("frame", {{"tick", frame.tick}, {"mesh", hex(checksum(client_.mesh().positions()))}});
    };
    h.on_force = [this](const net::ForceMessage& force) {
      const Vec3& f = force.forces.force_n;
      say("force", {{"input_stamp_ns", force.input_stamp_ns}, {"force_n", {f.x(), f.y(), f.z()}}});
      const bool is_latched = force.flags & net::kForceLatched;
      if (is_latched && !was_latched_) client_.arm();
      was_latched_ = is_latched;
    };
    h.on_event = [](const net::EventMessage& event) {
      say("event", {{"kind", event.kind}, {"text", event.text}});
    };
    h.on_error = [](const net::ErrorMessage& error) {
      say("error", {{"code", error.code}, {"fatal", error.fatal ? 1 : 0}, {"text", error.text}});
    };
    h.on_closed = [this](const std::string& reason) {
      timer_->cancel();
      say("closed", reason);
    };
    return h;
  }

  void send_poses() {
    const RigidTransform X_WN = track(k_++);
    if (X_WN.p.allFinite()) client_.send_pose(X_WN, net::real_clock().now_ns());
    timer_->start(interval_, [this] { send_poses(); });
  }

  boost::asio::io_context io_{1};
  const std::unique_ptr<net::Timer> timer_;
  const bool is_device_;
  std::chrono::nanoseconds interval_ = std::chrono::milliseconds(10);
  int k_ = 0;
  bool was_latched_ = false;
  net::Client client_;
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 4) throw UserError("usage: conformance_client HOST PORT ROLE [TOKEN]");
  net::ClientOptions options;
  options.name = "conformance in C++";
  if (std::string(argv[3]) == "device") {
    options.role = net::Role::kDevice;
    options.subscription = net::kSubscribeNoMesh;
  }
  if (argc > 4) options.token = net::from_hex(argv[4]);
  ConformanceClient(options).run(argv[1], static_cast<std::uint16_t>(std::stoi(argv[2])));
} catch (const std::exception& e) {
  std::cerr << "conformance_client: " << e.what() << "\n";
  return 2;
}
