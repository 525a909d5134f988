// A relay's handling of a broker's payloads: chunks of a script's messages, intact or with flaws, and arbitrary
// payloads. Its mesh always equals that of the accepted frames, and memory is allocated only for received data.
#include <optional>

#include "net/broker/chunks.h"
#include "net/broker/relayed_mesh.h"
#include "net/client/server_messages.h"
#include "net/wire/frame_encoder.h"
#include "tests/fuzz/message_script.h"

namespace brachy::fuzz {
namespace {

using namespace net;

constexpr std::uint32_t kMaxMessageBytes = 1 << 20;
constexpr std::size_t kNeedles = 2;

/// Faults of a chunk; other values: it arrives unchanged.
enum ChunkFlaw : std::uint8_t { kMissing = 1, kTwice = 2, kCut = 3, kOtherPublisher = 4 };

class Relay {
 public:
  void take(std::span<const std::byte> payload) {
    came_ += payload.size();
    const auto taken = chunks_.take(payload);
    EXPECT_LE(chunks_.allocated_bytes(), 2 * came_);
    EXPECT_EQ(taken == ChunkAssembler::Taken::kLost,
              taken == ChunkAssembler::Taken::kLost && chunks_.is_waiting());
    if (taken != ChunkAssembler::Taken::kMessage) return;
    const ChunkAssembler::Message& message = chunks_.message();
    EXPECT_EQ(message.header.length, message.body.size());
    is_refused_ = false;
    if (!messages_.take(message.header, message.body).empty() || is_refused_) chunks_.lose();
  }

 private:
  MessageHandlers handlers() {
    MessageHandlers h;
    h.on_topology = [this](const TopologyMessage& topology) {
      if (mesh_) {
        is_refused_ = topology.hash != topology_.hash;
        return;
      }
      mesh_.emplace(topology, kNeedles);
      topology_ = topology;
    };
    h.on_frame = [this](const FrameMessage& frame) {
      is_refused_ = !mesh_->fits(frame);
      if (is_refused_) return;
      mesh_->take(frame, 7);
      EXPECT_EQ(mesh_->state().summary.tick, frame.tick);
      show();
    };
    return h;
  }
  /// A viewer that joins now receives the relay's copy of the mesh.
  void show() {
    const FrameLayout layout = make_layout(mesh_->tissue(), topology_);
    Bytes body;
    encode_frame(mesh_->state(), layout, 1, {0, true, true}, body);
    FrameMessage frame;
    const DecodeResult result = decode_body(body, frame);
    EXPECT_TRUE(result.is_good()) << result.reason;
    FrameAssembler viewer;
    EXPECT_EQ(viewer.start(topology_), "");
    EXPECT_EQ(viewer.apply(frame), "");
    const auto bits = [](const FrameAssembler& mesh) {
      const auto bytes = std::as_bytes(std::span(mesh.positions()));
      return Bytes(bytes.begin(), bytes.end());
    };
    EXPECT_TRUE(bits(viewer) == bits(messages_.mesh()));
    EXPECT_EQ(viewer.seeds().size(), messages_.mesh().seeds().size());
  }

  std::size_t came_ = 0;
  bool is_refused_ = false;
  ChunkAssembler chunks_{kMaxMessageBytes};
  TopologyMessage topology_;
  std::optional<RelayedMesh> mesh_;
  ServerMessages messages_{handlers()};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Script script(data, size);
  Relay relay;
  ServerScript server(script);
  std::uint64_t epoch = 1, sequence = 0;
  while (!script.is_over()) {
    const unsigned what = script.u8();
    if (what == 255) {
      relay.take(script.piece());
      continue;
    }
    if (what == 254) ++epoch, sequence = 0;
    const std::size_t payload = kChunkHeaderSize + 1 + 8 * std::size_t{script.u8()};
    const Bytes message = server.next();
    Bytes buffer;
    send_chunks({1, epoch, ++sequence, 0, 0}, std::span(message).first(kHeaderSize),
                std::span(message).subspan(kHeaderSize), payload, buffer,
                [&](std::span<const std::byte> chunk) {
                  Bytes sent(chunk.begin(), chunk.end());
                  const std::uint8_t flaw = what < 200 ? std::uint8_t{0} : script.u8();
                  if (flaw == kMissing) return true;
                  if (flaw == kTwice) relay.take(sent);
                  if (flaw == kCut) sent.pop_back();
                  if (flaw == kOtherPublisher) sent[8] = std::byte{2};
                  relay.take(sent);
                  return true;
                });
  }
  return 0;
}

}  // namespace brachy::fuzz
