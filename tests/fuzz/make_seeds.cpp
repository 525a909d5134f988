// Writes the initial corpus of every fuzz target, from our own encoders and the files in config: fuzz_seeds FOLDER.
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "apps/forces/force_log.h"
#include "apps/recording/recording_file.h"
#include "core/brachytherapy/plan/plan_file.h"
#include "core/brachytherapy/seeds/seed_file.h"
#include "core/geometry/surface/surface_mesh.h"
#include "haptics/trajectory/needle_trajectories.h"
#include "net/igtl/codec/big_endian.h"
#include "net/igtl/codec/codec.h"
#include "net/wire/frame_encoder.h"
#include "test_paths.h"
#include "tests/core/geometry/tissue/mesh_fixtures.h"
#include "tests/core/geometry/volume/nrrd_fixtures.h"
#include "tests/fuzz/fuzzing.h"
#include "tests/net/fake_simulation.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::fuzz {
namespace {

using net::Bytes;
using net::MessageType;
using net::test::body_of;

const std::filesystem::path kConfig = BRACHY_SOURCE_DIR "/config";

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A script's bytes, as fuzzing.h reads them.
class Steps {
 public:
  Steps& u8(unsigned value) {
    text_ += static_cast<char>(value);
    return *this;
  }
  Steps& piece(std::string_view bytes) {
    u8(bytes.size() & 0xFF).u8(bytes.size() >> 8);
    text_ += bytes;
    return *this;
  }
  Steps& text(std::string_view bytes) {
    text_ += bytes;
    return *this;
  }
  Steps& message(MessageType type, std::span<const std::byte> body) {
    return u8(static_cast<unsigned>(type)).u8(0).piece(text_of(body));
  }
  template <class Message>
  Steps& message(const Message& message) {
    return this->message(Message::kType, body_of(message));
  }
  const std::string& str() const { return text_; }

 private:
  std::string text_;
};

class Corpus {
 public:
  explicit Corpus(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void add(const std::string& target, const std::string& name, const std::string& input) const {
    std::filesystem::create_directories(folder_ / target);
    std::ofstream(folder_ / target / name, std::ios::binary) << input;
  }

 private:
  std::filesystem::path folder_;
};

net::HelloMessage hello(net::Role role, std::uint32_t subscription = 0) {
  net::HelloMessage hello;
  hello.role = role;
  hello.subscription = subscription;
  hello.name = "fuzz";
  return hello;
}

/// Messages of a server to a viewer: topology, a full frame, changes, and a seed.
std::vector<std::pair<MessageType, Bytes>> server_messages() {
  const Tissue tissue = net::test::line_tissue(3);
  net::test::FakeSimulation simulation(tissue, 1, 2);
  const net::TopologyMessage topology = net::make_topology(tissue, "line");
  const net::FrameLayout layout = net::make_layout(tissue, topology);
  std::vector<std::pair<MessageType, Bytes>> all = {
      {MessageType::kWelcome, body_of(net::test::sample_welcome())},
      {MessageType::kTopology, body_of(topology)},
      {MessageType::kScene, body_of(net::test::sample_scene())}};
  for (std::uint64_t tick = 0; tick < 5; tick += 2) {
    simulation.steps(2);
    if (tick == 2) {
      simulation.state().seeds.slots = {net::test::sample_seed()};
      simulation.state().seeds.slots[0].id = 1;
      simulation.state().seeds.ticks = {simulation.state().summary.tick};
      simulation.state().seeds.count = 1;
    }
    if (tick == 4)
      simulation.state().needles.states[1].shape = net::test::sample_frame().needles[0].state.shape;
    Bytes frame;
    net::encode_frame(simulation.state(), layout, 1 + tick, {tick, tick == 0, true, false}, frame);
    all.emplace_back(MessageType::kFrame, frame);
  }
  for (const auto& [type, body] : net::test::sample_bodies())
    if (type == MessageType::kState || type == MessageType::kEvent || type == MessageType::kDose ||
        type == MessageType::kError || type == MessageType::kForce || type == MessageType::kLocalModel ||
        type == MessageType::kImage || type == MessageType::kScanner)
      all.emplace_back(type, body);
  return all;
}

void add_wire(const Corpus& corpus) {
  for (const auto& [type, body] : net::test::sample_bodies())
    corpus.add("wire_bodies", std::to_string(static_cast<int>(type)),
               Steps().u8(static_cast<unsigned>(type)).text(text_of(body)).str());
  Steps stream, recording, relayed, in_pieces;
  for (const auto& [type, body] : server_messages()) {
    stream.message(type, body);
    recording.u8(0).message(type, body);
    relayed.u8(0).u8(255).message(type, body);
    in_pieces.u8(0).u8(20).message(type, body);
  }
  in_pieces.u8(255).piece("BRCN");
  corpus.add("relay", "session", relayed.str());
  corpus.add("relay", "in_pieces", in_pieces.str());
  corpus.add("server_messages", "session", stream.str());
  corpus.add("recording", "session", recording.str());
}

// The first byte of server_fuzz.cpp's script.
constexpr unsigned kNoTokens = 0, kTokens = 1;
// Its steps: the client, what happens, and more.
constexpr unsigned kTcp = 0, kWebSocket = 1, kRaw = 2, kWritten = 3, kLeave = 4, kPublish = 5, kForce = 6,
                   kShow = 9;

void add_server(const Corpus& corpus) {
  const auto client = [](Steps& steps, unsigned who, unsigned what) -> Steps& {
    return steps.u8(who).u8(what);
  };
  for (const unsigned transport : {kTcp, kWebSocket}) {
    Steps steps;
    steps.u8(kNoTokens);
    client(steps, 0, transport).message(hello(net::Role::kDevice));
    client(steps, 0, kWritten), client(steps, 0, kPublish), client(steps, 0, kWritten);
    net::PoseMessage pose;
    client(steps, 0, transport).message(pose);
    client(steps, 0, kForce).u8(0);
    client(steps, 0, kWritten), client(steps, 0, kWritten);
    client(steps, 0, transport).message(net::DropMessage{0, true});
    client(steps, 0, transport).message(net::ArmMessage{0});
    client(steps, 0, transport).message(net::PingMessage{});
    client(steps, 1, transport).message(hello(net::Role::kOperator, 31));
    client(steps, 1, kShow).u8(1);
    client(steps, 1, transport).message(net::test::sample_control());
    client(steps, 1, transport).message(MessageType::kState, {});
    client(steps, 2, transport).message(hello(net::Role::kViewer));
    client(steps, 2, kWritten);
    client(steps, 0, kLeave);
    corpus.add("server", transport == kTcp ? "tcp" : "websocket", steps.str());
  }
  Bytes raw;
  net::encode(hello(net::Role::kViewer, 4), 1, 1, raw);
  net::encode(net::PingMessage{}, 2, 1, raw);
  Steps steps;
  steps.u8(kNoTokens);
  client(steps, 0, kRaw).piece(text_of(std::span(raw).first(40)));
  client(steps, 0, kRaw).piece(text_of(std::span(raw).subspan(40)));
  corpus.add("server", "raw", steps.str());

  Steps tokens;
  tokens.u8(kTokens);
  client(tokens, 0, kTcp).message(net::test::sample_hello_with_token());
  client(tokens, 0, kTcp).message(net::test::sample_control());
  net::HelloMessage device = hello(net::Role::kDevice);
  device.token.emplace();
  client(tokens, 1, kTcp).message(device);
  client(tokens, 1, kTcp).message(net::PoseMessage{});
  client(tokens, 2, kTcp).message(hello(net::Role::kViewer));
  corpus.add("server", "tokens", tokens.str());

  for (const unsigned reads : {0u, 1u}) {
    Steps frames;
    frames.u8(reads);
    frames.u8(0).u8(0).message(hello(net::Role::kViewer));
    frames.u8(0).u8(1).message(net::PingMessage{});
    frames.u8(1).u8(2).u8(0x89).piece("ping");
    frames.u8(0).u8(0).message(net::DropMessage{});
    frames.u8(1).u8(0).message(net::StateMessage{});
    frames.u8(0).u8(2).u8(0x81).piece("text");
    frames.u8(0).u8(2).u8(0x88).piece("\x03\xE8");
    corpus.add("websocket", reads == 0 ? "reads" : "reads_not", frames.str());
  }
}

// As igtl_script.cpp counts them.
constexpr unsigned kTransform = 0, kNeedle = 0;

void add_igtl(const Corpus& corpus) {
  namespace igtl = net::igtl;
  const Bytes encoded = igtl::encode_transform({1, "NeedleToRas", 1}, {Mat3::Identity(), Vec3(1, 2, 3)});
  const std::string transform = text_of(std::span(encoded).subspan(igtl::kHeaderSize));
  Bytes extended;
  const std::string key = "TransformStatus", value = "MISSING";
  igtl::put(extended, std::uint16_t{12});
  igtl::put(extended, std::uint16_t{10});
  igtl::put(extended, static_cast<std::uint32_t>(key.size() + value.size()));
  igtl::put(extended, std::uint32_t{0});
  igtl::put_name(extended, transform, transform.size());
  igtl::put(extended, std::uint16_t{1});
  igtl::put(extended, static_cast<std::uint16_t>(key.size()));
  igtl::put(extended, std::uint16_t{3});
  igtl::put(extended, static_cast<std::uint32_t>(value.size()));
  igtl::put_name(extended, key + value, key.size() + value.size());
  Steps stream, session;
  const auto add = [&](unsigned type, unsigned device, unsigned version, std::string_view body) {
    for (Steps* steps : {&stream, &session}) {
      if (steps == &session) session.u8(0);
      steps->u8(type).u8(device).u8(version).u8(0).piece(body);
    }
  };
  add(3, 4, 1, "");
  add(kTransform, kNeedle, 1, transform);
  add(kTransform, kNeedle, 2, text_of(extended));
  add(5, 0, 1, std::string(36, '\0'));
  session.u8(3).u8(3).u8(2).u8(2);
  for (const unsigned query : {1u, 2u, 4u, 6u, 8u}) add(query, 0, 1, "");
  session.u8(2).u8(2).u8(4).u8(100);
  corpus.add("igtl_parser", "stream", stream.str());
  corpus.add("igtl_session", "session", session.str());
}

void add_http(const Corpus& corpus) {
  const std::string host = "Host: 127.0.0.1:18980\r\n";
  corpus.add("http", "get", "GET / HTTP/1.1\r\n" + host + "Accept-Encoding: gzip, br;q=0\r\n\r\n");
  corpus.add("http", "head", "HEAD /index.html?x HTTP/1.1\r\n" + host + "If-None-Match: \"0\"\r\n\r\n");
  corpus.add("http", "post", "POST / HTTP/1.1\r\n" + host + "Content-Length: 3\r\n\r\nabc");
  corpus.add("http", "upgrade",
             "GET /ws HTTP/1.1\r\n" + host +
                 "Origin: http://127.0.0.1:18980\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                 "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
  corpus.add("http_answer", "page", "\x01GET\n/\nlocalhost:18980\n\ngzip;q=0.5, *\n\"0\"\n");
  corpus.add("http_answer", "upgrade", "\x0bGET\n/ws\n[::1]:80\nhttp://[::1]:80\n\n\n");
}

void add_files(const Corpus& corpus) {
  for (const auto& entry : std::filesystem::directory_iterator(kConfig)) {
    const std::filesystem::path& file = entry.path();
    const bool is_plan = file.filename() == "plan.toml";
    if (file.filename() == "hdr_plan.toml") {
      corpus.add("source", file.stem(), "\x01" + read(file));
      continue;
    }
    if (file.extension() == ".csv") corpus.add("trajectory", file.stem(), read(file));
    if (file.extension() == ".toml")
      corpus.add(is_plan ? "plan" : "scene", file.stem(), (is_plan ? std::string(1, '\0') : "") + read(file));
  }
  for (const auto& entry : std::filesystem::directory_iterator(kConfig / "sources"))
    corpus.add("source", entry.path().stem(), std::string(1, '\0') + read(entry.path()));
  Plan plan = load_plan(kConfig / "plan.toml", {});
  plan.needles.resize(2);
  corpus.add("plan", "csv", "\x01" + to_csv(plan, {}));
}

std::string table_of(std::string_view header, const std::string& row) {
  return std::string(header) + "\n" + row + "\n";
}

void add_tables(const Corpus& corpus) {
  Seed seed = net::test::sample_seed();
  seed.id = 1;
  const std::string seeds = table_of(kSeedHeader, seed_row(seed));
  const std::string forces = table_of(kForceLogHeader, force_row(force_sample(0.005, 0, {}, 0.5)));
  corpus.add("tables", "seeds", Steps().u8(0).text(seeds).str());
  corpus.add("tables", "dose",
             Steps().u8(1).text("x,y,z,ax,ay,az,source,strength_u\n1,2,3,0,0,2,6711,0.5\n").str());
  corpus.add("tables", "forces", Steps().u8(2).text(forces).str());
  corpus.add("tables", "landmarks",
             Steps().u8(3).text("x,y,z,dx,dy,dz,core_mm,support\n0,0,10,0,0,2,3,12\n").str());
  std::string beads = "i,j,k,x0,y0,z0,x1,y1,z1\n";
  for (int i = 0; i < 27; ++i) {
    const int x = i % 3, y = i / 3 % 3, z = i / 9;
    for (const int v : {x, y, z, 10 * x, 10 * y, 10 * z, 10 * x, 10 * y}) beads += std::to_string(v) + ",";
    beads += std::to_string(10 * z + 1) + "\n";
  }
  corpus.add("beads", "beads", Steps().text(beads).str());

  TrajectorySample sample{0.005, RigidTransform(), true};
  const TrajectoryColumns columns{true, true};
  const std::string poses = table_of(trajectory_header(columns), trajectory_row(sample, 1, columns));
  corpus.add("session", "whole", Steps().piece(seeds).piece(poses).piece(forces).str());
  corpus.add(
      "session", "torn",
      Steps().piece(seeds.substr(0, seeds.size() - 9)).piece(poses + poses.substr(60, 20)).piece("").str());
}

void add_meshes(const Corpus& corpus) {
  const SurfaceMesh box = test::make_box({0, 0, 0}, {10, 8, 6});
  const auto add = [&](const std::string& name, unsigned format, const std::string& bytes) {
    corpus.add("mesh", name, Steps().u8(format).text(bytes).str());
  };
  add("binary_stl", 0, test::binary_stl(box));
  add("text_stl", 0, test::text_stl(box));
  add("obj", 1, test::text_obj(box));
  for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"})
    add(encoding, 2, test::ply(box, encoding));
}

void add_volumes(const Corpus& corpus) {
  test::NrrdText text;
  const auto add = [&](const std::string& name, unsigned packed, const std::string& data) {
    corpus.add("nrrd", name, Steps().u8(packed).text(text.header() + data).str());
  };
  const std::string bytes(24, 'v');
  add("raw", 0, bytes);
  text.space = "LPS";
  text.encoding = "gzip";
  add("gzip", 0, test::gzipped(bytes));
  add("packed", 1, bytes);
  text.type = "float";
  text.more = "endian: big\nbyte skip: 4\n";
  add("floats", 1, std::string(100, '@'));
  text.encoding = "ascii";
  text.sizes = "2 2 1";
  text.more = "line skip: 1\nkey:=value\n";
  add("text", 0, "skipped\n1 2 -3e1 0.5\n");
}

}  // namespace
}  // namespace brachy::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: fuzz_seeds FOLDER\n";
    return 2;
  }
  using namespace brachy::fuzz;
  const Corpus corpus(argv[1]);
  add_wire(corpus);
  add_server(corpus);
  add_igtl(corpus);
  add_http(corpus);
  add_files(corpus);
  add_tables(corpus);
  add_meshes(corpus);
  add_volumes(corpus);
  return 0;
}
