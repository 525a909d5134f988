#include "tests/net/net_testing.h"

namespace brachy::net::test {

ClientHandlers Recorder::handlers() {
  ClientHandlers handlers;
  handlers.on_welcome = [this](const WelcomeMessage& message) { ++welcomes, welcome = message; };
  handlers.on_topology = [this](const TopologyMessage& message) { ++topologies, topology = message; };
  handlers.on_frame = [this](const FrameMessage& message) { frames.push_back(message); };
  handlers.on_state = [this](const StateMessage& message) { states.push_back(message); };
  handlers.on_dose = [this](const DoseMessage& message) { doses.push_back(message); };
  handlers.on_scene = [this](const SceneMessage& message) { scenes.push_back(message); };
  handlers.on_image = [this](const ImageMessage& message) { images.push_back(message); };
  handlers.on_scanner = [this](const ScannerMessage& message) { scanners.push_back(message); };
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
  handlers.on_scanner = [this](const ScannerMessage& request, const std::string&) {
    scanner_requests.push_back(request);
    return control_refusal;
  };
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
  options.clock = &clock;
  server = std::make_unique<Server>(io, options, tissue, handlers);
}

ClientOptions ServerFixture::on_clock(ClientOptions options) {
  options.clock = &clock;
  return options;
}

std::unique_ptr<Recorder> ServerFixture::join(ClientOptions options) {
  auto recorder = std::make_unique<Recorder>(io, on_clock(std::move(options)));
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
