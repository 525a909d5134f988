#include "tests/fuzz/hostile_peer.h"

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>

#include "net/igtl/codec/codec.h"
#include "tests/net/http/websocket_peer.h"
#include "tests/net/igtl/igtl_peer.h"
#include "tests/net/wire/sample_messages.h"

namespace brachy::fuzz {
namespace {

using net::Bytes;

std::size_t below(std::mt19937& random, std::size_t count) {
  return count == 0 ? 0 : random() % count;
}
bool chance(std::mt19937& random, unsigned percent) {
  return random() % 100 < percent;
}

void mutate(Bytes& bytes, std::mt19937& random) {
  constexpr std::array<std::uint8_t, 8> kInteresting = {0, 1, 0x7F, 0x80, 0xFE, 0xFF, 0x0A, 0x20};
  for (auto times = 1 + below(random, 4); times > 0; --times) {
    const std::size_t at = below(random, bytes.size());
    const auto place = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    switch (random() % 7) {
      case 0:
        if (!bytes.empty()) bytes[at] ^= static_cast<std::byte>(1u << random() % 8);
        break;
      case 1:
        if (!bytes.empty()) bytes[at] = static_cast<std::byte>(kInteresting[random() % kInteresting.size()]);
        break;
      case 2:  // a number of four bytes
        for (std::size_t i = at; i < std::min(at + 4, bytes.size()); ++i)
          bytes[i] = static_cast<std::byte>(random() & 0xFF);
        break;
      case 3:
        bytes.insert(place, 1 + below(random, 40), static_cast<std::byte>(random() & 0xFF));
        break;
      case 4:
        bytes.erase(place, place + static_cast<std::ptrdiff_t>(
                                       below(random, std::min<std::size_t>(bytes.size() - at, 40))));
        break;
      case 5:
        if (chance(random, 30)) bytes.resize(at);
        break;
      default: {  // a part of it a second time
        const Bytes part(place, place + static_cast<std::ptrdiff_t>(below(random, bytes.size() - at)));
        bytes.insert(bytes.end(), part.begin(), part.end());
      }
    }
  }
}

/// A client's messages in the order of their numbers. Commands of an operator are excluded: they would start another
/// model or a new simulation, which would then be measured.
class NativeClient {
 public:
  explicit NativeClient(std::mt19937& random) : random_(random) {}

  Bytes hello() {
    net::HelloMessage hello;
    hello.role = static_cast<net::Role>(1 + below(random_, 3));
    // The whole mesh rarely: it is a third of a megabyte.
    hello.subscription = chance(random_, 3)    ? net::kSubscribeFullFrames
                         : chance(random_, 30) ? net::kSubscribeSurface
                                               : net::kSubscribeNoMesh;
    if (chance(random_, 20)) hello.subscription |= net::kSubscribeScene | net::kSubscribePoseHistory;
    hello.name = "hostile";
    if (chance(random_, 50)) hello.needle = static_cast<std::uint16_t>(random_() % 3);
    hello.device_flags = static_cast<std::uint16_t>(random_() % 2);
    return encoded(hello);
  }

  Bytes other() {
    switch (random_() % 8) {
      case 0:
      case 1: {
        net::PoseMessage pose;
        pose.needle = 1;
        pose.X_WN.p = {1.0 * static_cast<double>(random_() % 20), 0,
                       -60 + static_cast<double>(random_() % 90)};
        return encoded(pose);
      }
      case 2:
        return encoded(net::PingMessage{random_(), chance(random_, 50), 1, 2});
      case 3:
        return encoded(net::ArmMessage{static_cast<std::uint16_t>(random_() % 3)});
      case 4:
        return encoded(net::DropMessage{1, chance(random_, 50)});
      case 5: {
        net::ControlMessage control;
        control.action =
            chance(random_, 50) ? net::ControlAction::kStop : static_cast<net::ControlAction>(99);
        control.kernel = "none";
        return encoded(control);
      }
      case 6: {  // an empty STATE
        Bytes request;
        net::encode_header({net::kProtocolVersion, net::MessageType::kState, 0, 0, ++sequence_, 1}, request);
        return request;
      }
      default: {  // any message, also those that only a server sends
        auto samples = net::test::sample_bodies();
        std::erase_if(samples, [](const auto& s) { return s.first == net::MessageType::kControl; });
        const auto& [type, body] = samples[below(random_, samples.size())];
        Bytes message;
        net::encode_header(
            {net::kProtocolVersion, type, 0, static_cast<std::uint32_t>(body.size()), ++sequence_, 1},
            message);
        message.insert(message.end(), body.begin(), body.end());
        return message;
      }
    }
  }

  /// Its body alone, or the whole of it, is changed.
  void mutate_message(Bytes& message) {
    if (chance(random_, 50) || message.size() <= net::kHeaderSize) return mutate(message, random_);
    Bytes body(message.begin() + net::kHeaderSize, message.end());
    for (auto flips = 1 + below(random_, 3); flips > 0; --flips)
      body[below(random_, body.size())] = static_cast<std::byte>(random_() & 0xFF);
    std::ranges::copy(body, message.begin() + net::kHeaderSize);
  }

 private:
  template <class Message>
  Bytes encoded(const Message& message) {
    Bytes bytes;
    net::encode(message, ++sequence_, static_cast<std::int64_t>(random_()), bytes);
    return bytes;
  }

  std::mt19937& random_;
  std::uint64_t sequence_ = 0;
};

Conversation native_conversation(std::uint16_t port, bool is_websocket, std::mt19937& random) {
  Conversation conversation{port, {}};
  NativeClient client(random);
  const auto add = [&](Bytes message, unsigned mutated_percent) {
    const bool is_mutated = chance(random, mutated_percent);
    const bool in_frame = is_websocket && is_mutated && chance(random, 30);
    if (is_mutated && !in_frame) client.mutate_message(message);
    if (is_websocket)
      message = net::test::websocket_frame(net::test::Opcode::kBinary, message, !chance(random, 5));
    if (in_frame) mutate(message, random);
    conversation.sends.push_back({std::move(message), is_mutated});
  };
  if (is_websocket) {
    const std::string request = net::test::upgrade_request(port);
    const auto bytes = std::as_bytes(std::span(request));
    Bytes sent(bytes.begin(), bytes.end());
    const bool is_mutated = chance(random, 15);
    if (is_mutated) mutate(sent, random);
    conversation.sends.push_back({std::move(sent), is_mutated});
  }
  add(client.hello(), 15);
  for (auto messages = 1 + below(random, 8); messages > 0; --messages) add(client.other(), 60);
  return conversation;
}

Conversation igtl_conversation(std::uint16_t port, std::mt19937& random) {
  namespace igtl = net::igtl;
  constexpr std::array<const char*, 8> kQueries = {"GET_TRANS", "GET_POLYDATA", "GET_STATUS", "GET_CAPABIL",
                                                   "STT_TDATA", "STP_TDATA",    "IMAGE",      "STATUS"};
  Conversation conversation{port, {}};
  for (auto messages = 1 + below(random, 8); messages > 0; --messages) {
    const auto version = static_cast<std::uint16_t>(1 + random() % 2);
    const Vec3 tip(static_cast<double>(random() % 20), 0, -60 + static_cast<double>(random() % 90));
    Bytes message = chance(random, 50)
                        ? igtl::encode_transform({version, "Needle1ToRas", 1}, {Mat3::Identity(), tip})
                        : igtl::encode_empty(kQueries[random() % kQueries.size()], {version, "hostile", 1});
    const bool is_mutated = chance(random, 60);
    if (is_mutated) {
      mutate(message, random);
      if (message.size() > igtl::kHeaderSize && chance(random, 50))
        message = igtl::test::with_right_size_and_crc(std::move(message));
    }
    conversation.sends.push_back({std::move(message), is_mutated});
  }
  return conversation;
}

}  // namespace

Conversation make_conversation(const Doors& doors, std::mt19937& random) {
  switch (random() % 5) {
    case 0:
      return igtl_conversation(doors.igtl, random);
    case 1:
    case 2:
      return native_conversation(doors.http, true, random);
    default:
      return native_conversation(doors.native, false, random);
  }
}

Conversation greedy_conversation(const Doors& doors) {
  net::HelloMessage hello;
  hello.subscription = net::kSubscribeFullFrames;
  Bytes bytes;
  net::encode(hello, 1, 1, bytes);
  return {doors.native, {{bytes, false}}};
}

HostilePeer::HostilePeer(boost::asio::io_context& io, Conversation conversation, std::mt19937& random)
    : conversation_(std::move(conversation)),
      random_(random),
      socket_(io),
      reads_(chance(random, 70)),
      resets_(chance(random, 30)),
      lingers_(chance(random, 20)) {
  boost::system::error_code error;
  socket_.connect({boost::asio::ip::address_v4::loopback(), conversation_.port}, error);
  if (!error) socket_.non_blocking(true, error);
  is_ended_ = bool{error};
}

bool HostilePeer::step() {
  read();
  if (is_ended_ || --turns_left_ == 0) return end();
  if (sent_ == conversation_.sends.size()) return lingers_ || end();
  const auto& [message, is_mutated] = conversation_.sends[sent_];
  const std::size_t left = message.size() - at_;
  const std::size_t size = chance(random_, 15) ? std::min<std::size_t>(left, 1 + random_() % 40) : left;
  boost::system::error_code error;
  at_ += socket_.write_some(boost::asio::buffer(message.data() + at_, size), error);
  if (error && error != boost::asio::error::would_block) return end();
  if (at_ < message.size()) return true;
  at_ = 0;
  ++sent_;
  mutated_sent_ += is_mutated;
  return true;
}

/// Some read nothing, but detect the end of the stream.
void HostilePeer::read() {
  std::array<char, 64 * 1024> ignored;
  boost::system::error_code error;
  while (reads_ && !error) socket_.read_some(boost::asio::buffer(ignored), error);
  is_ended_ = is_ended_ || (error && error != boost::asio::error::would_block);
}

bool HostilePeer::end() {
  boost::system::error_code ignored;
  if (resets_) socket_.set_option(boost::asio::socket_base::linger(true, 0), ignored);
  socket_.close(ignored);
  return false;
}

}  // namespace brachy::fuzz
