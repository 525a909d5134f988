// A browser's connection after its upgrade, over a socket: a script of frames, whole, in fragments or invalid.
// Everything that the server sends is well-formed (tests/net/http/websocket_peer.h), and the connection is closed
// afterwards.
#include <utility>

#include "net/http/http_listener.h"
#include "tests/fuzz/message_script.h"
#include "tests/net/http/websocket_peer.h"
#include "tests/net/net_testing.h"

namespace brachy::fuzz {
namespace {

using namespace net;

/// A server with an HTTP port and a snapshot that no small buffer holds.
struct Page {
  Page() {
    server.publish(simulation.snapshot());
    serve();
  }
  ServerOptions options() {
    ServerOptions options;
    options.clock = &clock;
    options.max_message_bytes = 1024;
    options.send_buffer_bytes = 4096;
    return options;
  }
  void serve() {
    while (io.poll() > 0) continue;
  }
  /// Likewise until the condition holds; 5 ms pass each time there is nothing to do.
  template <class Condition>
  bool until(Condition&& condition) {
    return net::test::pump_turns(io, condition, [this] { clock.advance(std::chrono::milliseconds(5)); });
  }
  net::test::ManualClock clock;
  boost::asio::io_context io;
  const Tissue& tissue = large_tissue();
  net::test::FakeSimulation simulation{tissue};
  Server server{io, options(), tissue, {}};
  HttpListener http{io, server, {}, {}, [](const std::string&) {}};

 private:
  static const Tissue& large_tissue() {
    static const Tissue tissue = net::test::line_tissue(2000);
    return tissue;
  }
};

/// The next step of the script: what is sent.
Bytes next_frames(Script& script, std::uint64_t& sequence) {
  const std::uint8_t what = script.u8();
  switch (what % 4) {
    case 0:  // a message
      return net::test::websocket_frame(net::test::Opcode::kBinary, next_message(script, ++sequence));
    case 1: {  // in three fragments
      const Bytes message = next_message(script, ++sequence);
      const auto all = std::span<const std::byte>(message);
      const std::size_t third = all.size() / 3;
      Bytes frames = net::test::websocket_frame(net::test::Opcode::kBinary, all.first(third), false);
      for (const auto& frame :
           {net::test::websocket_frame(net::test::Opcode::kContinuation, all.subspan(third, third), false),
            net::test::websocket_frame(net::test::Opcode::kContinuation, all.subspan(2 * third))})
        frames.insert(frames.end(), frame.begin(), frame.end());
      return frames;
    }
    case 2: {  // any frame
      const std::uint8_t first = script.u8();
      Bytes frame = net::test::websocket_frame(net::test::Opcode::kBinary, script.piece(), true, what < 200);
      frame[0] = std::byte{first};
      return frame;
    }
    default: {
      const auto bytes = script.piece();
      return {bytes.begin(), bytes.end()};
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Page page;
  Script script(data, size);
  const bool reads = script.u8() % 2 == 0;
  {
    net::test::WebSocketPeer peer(page.io, page.http.port(), reads ? 0 : 4096);
    EXPECT_TRUE(page.until([&] {
      peer.take();
      return peer.is_open();
    }));
    std::uint64_t sequence = 0;
    Bytes together;  // frames that come at once
    while (!script.is_over() && !peer.is_ended()) {
      const bool is_last = script.u8() % 2 == 0;
      const Bytes frames = next_frames(script, sequence);
      together.insert(together.end(), frames.begin(), frames.end());
      if (!is_last && !script.is_over()) continue;
      peer.send(std::exchange(together, {}));
      page.serve();
      if (reads) peer.take();
    }
  }
  EXPECT_TRUE(page.until([&] { return page.server.client_count() == 0; }));
  page.server.stop();
  page.http.stop();
  EXPECT_TRUE(page.until([&] { return page.io.stopped(); })) << "something of the connection is left";
  return 0;
}

}  // namespace brachy::fuzz
