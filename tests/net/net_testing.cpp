#include "tests/net/net_testing.h"

namespace brachy::net::test {

Tissue line_tissue(std::uint32_t blocks) {
  constexpr std::uint32_t kBlock = 5;
  Tissue tissue;
  tissue.surface_count = kBlock;
  for (std::uint32_t i = 0; i < blocks * kBlock; ++i)
    tissue.rest_vertices.push_back(Vec3(i, 0.5 * i, -1.0 * i));
  tissue.triangles = {{0, 1, 2}};
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const std::uint32_t first = b * kBlock;
    tissue.blocks.push_back(
        {first, kBlock, tissue.rest_vertices[first], tissue.rest_vertices[first + kBlock - 1]});
  }
  return tissue;
}

FakeSimulation::FakeSimulation(const Tissue& tissue, std::uint32_t seed, std::size_t needles)
    : blocks_(tissue.blocks), random_(seed) {
  for (const Vec3& p : tissue.rest_vertices) {
    for (int axis = 0; axis < 3; ++axis) state_.deformed_vertices.push_back(static_cast<float>(p[axis]));
  }
  state_.block_ticks.resize(blocks_.size());
  state_.needles.resize(needles);
  state_.pose_histories.resize(needles);
}

void FakeSimulation::step() {
  ++state_.tick;
  state_.sim_time_s = 0.005 * static_cast<double>(state_.tick);
  std::uniform_real_distribution<float> coordinate(-50, 50);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    if (random_() % 8 != 0) continue;
    state_.block_ticks[b] = state_.tick;
    for (std::size_t i = 0; i < 3 * std::size_t{blocks_[b].count}; ++i) {
      state_.deformed_vertices[3 * std::size_t{blocks_[b].first} + i] = coordinate(random_);
    }
  }
  for (std::size_t n = 0; n < state_.needles.size(); ++n) {
    NeedleState& needle = state_.needles[n];
    const auto number = static_cast<double>(n);
    needle.present = true;
    needle.X_WN.p.x() = static_cast<double>(state_.tick) + 100 * number;
    needle.input.sequence = state_.tick + 1000 * n;
    needle.input.received_ns = static_cast<std::int64_t>(state_.tick + n);
    needle.forces.force_n = Vec3(0, 1, -number);
    state_.pose_histories[n][state_.tick % MeshState::kPoseHistory] = {state_.tick, needle.X_WN};
  }
}

ClientHandlers Recorder::handlers() {
  ClientHandlers handlers;
  handlers.on_welcome = [this](const WelcomeMessage& message) { ++welcomes, welcome = message; };
  handlers.on_topology = [this](const TopologyMessage& message) { ++topologies, topology = message; };
  handlers.on_frame = [this](const FrameMessage& message) { frames.push_back(message); };
  handlers.on_state = [this](const StateMessage& message) { states.push_back(message); };
  handlers.on_dose = [this](const DoseMessage& message) { doses.push_back(message); };
  handlers.on_scene = [this](const SceneMessage& message) { scenes.push_back(message); };
  handlers.on_event = [this](const EventMessage& message) { events.push_back(message); };
  handlers.on_error = [this](const ErrorMessage& message) { errors.push_back(message); };
  handlers.on_force = [this](const ForceMessage& message) { forces.push_back(message); };
  handlers.on_local_model = [this](const LocalModelMessage& message) { models.push_back(message); };
  handlers.on_closed = [this](const std::string& reason) { closed.push_back(reason); };
  return handlers;
}

void ServerFixture::start(ServerOptions options) {
  ServerHandlers handlers;
  handlers.on_pose = [this](std::uint16_t needle, const NeedlePose& pose) {
    poses.push_back(pose);
    pose_needles.push_back(needle);
    return verdict;
  };
  handlers.on_device = [this](bool attached, const DeviceInfo& device) {
    devices.emplace_back(attached, device.name);
    last_device = device;
  };
  handlers.on_arm = [this](std::uint16_t needle, const std::string& who) { arms.emplace_back(needle, who); };
  handlers.on_drop = [this](std::uint16_t needle, bool pressed) { drops.emplace_back(needle, pressed); };
  handlers.on_control = [this](const ControlMessage& control, const std::string& who) {
    controls.emplace_back(control, who);
    return control_refusal;
  };
  handlers.state = [this] {
    StateMessage state;
    state.ticks = 1234;
    state.controls = {"psi31", 12, controls.empty() ? 0u : kScriptPlays};
    return state;
  };
  handlers.log = [this](const std::string& line) { log.push_back(line); };
  server = std::make_unique<Server>(io, options, tissue, handlers);
}

std::unique_ptr<Recorder> ServerFixture::join(ClientOptions options) {
  auto recorder = std::make_unique<Recorder>(io, options);
  recorder->client.connect("127.0.0.1", server->port());
  return recorder;
}

std::unique_ptr<Recorder> ServerFixture::join_as(Role role, const std::string& name) {
  ClientOptions options;
  options.role = role;
  options.name = name;
  auto recorder = join(options);
  EXPECT_TRUE(until([&] { return recorder->welcomes == 1 || !recorder->closed.empty(); }));
  return recorder;
}

}  // namespace brachy::net::test
