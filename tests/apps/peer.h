#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/realtime/deadline.h"
#include "net/client/client.h"
#include "tests/wait.h"

namespace brachy::test {

/// A client of a daemon that records what it receives. It is served only while its pump, or that of a peer that it
/// stands beside, runs.
class Peer {
 public:
  struct Frame {
    net::FrameMessage message;     ///< without its positions
    std::vector<float> positions;  ///< of the whole mesh after it, if kept
  };

  /// `keep_meshes`: a copy of the mesh with every frame.
  explicit Peer(net::Role role = net::Role::kViewer, std::uint32_t subscription = 0, bool keep_meshes = false,
                const std::string& name = "peer")
      : Peer(options(role, subscription, name), keep_meshes) {}
  explicit Peer(net::ClientOptions options, bool keep_meshes = false)
      : keep_meshes_(keep_meshes), client(io_, with_patience(std::move(options)), handlers()) {}

  void connect(std::uint16_t port) { client.connect("127.0.0.1", port); }

  /// Serves the connection until `condition()`; false where it does not come within the deadline.
  template <class Condition>
  bool until(Condition&& condition) {
    return wait_until(condition, [this] { poll(); });
  }
  /// Serves it once: until something happens, at most kTurn.
  void poll() {
    if (io_.stopped()) io_.restart();
    io_.run_one_for(kTurn);
    if (beside_) {
      if (beside_->io_.stopped()) beside_->io_.restart();
      beside_->io_.poll();
    }
  }
  /// Serves this one and `other` together from now on: neither falls silent while a slow daemon keeps one waiting.
  void stand_beside(Peer& other) {
    beside_ = &other;
    other.beside_ = this;
  }

  bool join(std::uint16_t port) {
    connect(port);
    return until([&] { return welcomed || !closed.empty(); }) && welcomed;
  }

  const Frame& last() const { return frames.back(); }
  const NeedleState& needle() const { return frames.back().message.needles.at(0).state; }

  /// Sends the pose and serves the connection until a frame shows it.
  bool show(const RigidTransform& X_WN) {
    const std::int64_t stamp_ns = monotonic_ns();
    client.send_pose(X_WN, stamp_ns);
    return until([&] { return !frames.empty() && last().message.input_stamp_ns == stamp_ns; });
  }

  /// Whether an event of this kind came that has `part` in its text.
  bool has_event(net::EventKind kind, const std::string& part = "") const {
    return std::ranges::any_of(events, [&](const net::EventMessage& e) {
      return e.kind == kind && e.text.find(part) != std::string::npos;
    });
  }

  /// The newest STATE, on request.
  bool refresh_state() {
    const std::size_t before = states.size();
    client.request_state();
    return until([&] { return states.size() > before || !client.is_open(); }) && client.is_open();
  }

 private:
  static net::ClientOptions options(net::Role role, std::uint32_t subscription, const std::string& name) {
    net::ClientOptions o;
    o.role = role;
    o.subscription = subscription;
    o.name = name;
    return o;
  }
  static net::ClientOptions with_patience(net::ClientOptions o) {
    o.silence_timeout = kDeadline;
    return o;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage&) { welcomed = true; };
    h.on_topology = [this](const net::TopologyMessage& t) { topology = t; };
    h.on_frame = [this](const net::FrameMessage& f) {
      frames.push_back({f, keep_meshes_ ? client.mesh().positions() : std::vector<float>()});
      frames.back().message.positions.clear();
      for (const TickPose& pose : f.pose_history) poses[pose.tick] = pose.X_WN;
    };
    h.on_state = [this](const net::StateMessage& s) { states.push_back(s); };
    h.on_event = [this](const net::EventMessage& e) { events.push_back(e); };
    h.on_error = [this](const net::ErrorMessage& e) { errors.push_back(e); };
    h.on_force = [this](const net::ForceMessage& m) { forces.push_back(m); };
    h.on_local_model = [this](const net::LocalModelMessage& m) { models.push_back(m); };
    h.on_dose = [this](const net::DoseMessage& m) { doses.push_back(m); };
    h.on_scene = [this](const net::SceneMessage& m) { scenes.push_back(m); };
    h.on_image = [this](const net::ImageMessage& m) { images.push_back(m); };
    h.on_plan = [this](const net::PlanMessage& m) { plans.push_back(m); };
    h.on_contour = [this](const net::ContourMessage& m) { contours.push_back(m); };
    h.on_scanner = [this](const net::ScannerMessage& m) { scanners.push_back(m); };
    h.on_closed = [this](const std::string& reason) { closed.push_back(reason); };
    return h;
  }

  boost::asio::io_context io_{1};
  bool keep_meshes_;
  Peer* beside_ = nullptr;

 public:
  bool welcomed = false;
  net::TopologyMessage topology;
  std::vector<Frame> frames;
  std::map<std::uint64_t, RigidTransform> poses;  ///< from POSE_HISTORY, by tick
  std::vector<net::StateMessage> states;
  std::vector<net::EventMessage> events;
  std::vector<net::ErrorMessage> errors;
  std::vector<net::ForceMessage> forces;
  std::vector<net::LocalModelMessage> models;
  std::vector<net::DoseMessage> doses;
  std::vector<net::SceneMessage> scenes;
  std::vector<net::ImageMessage> images;
  std::vector<net::PlanMessage> plans;
  std::vector<net::ScannerMessage> scanners;
  std::vector<net::ContourMessage> contours;
  std::vector<std::string> closed;
  net::Client client;
};

}  // namespace brachy::test
