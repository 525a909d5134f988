#include "net/c_api/client_handle.h"

#include <utility>

#include "net/wire/image_pixels.h"

namespace net = brachy::net;
namespace c_api = brachy::net::c_api;

namespace {

constexpr std::size_t kMostWaiting = 256;  // events, errors
constexpr int kMostHandlers = 10'000;  // of one poll: a server that never pauses does not hold it for ever

}  // namespace

void BrachydClient::run_ready() {
  for (int i = 0; i < kMostHandlers && io.poll_one() > 0; ++i) {
  }
}

net::ClientHandlers BrachydClient::handlers() {
  net::ClientHandlers h;
  h.on_welcome = [this](const net::WelcomeMessage& message) { welcome = c_api::welcome_of(message); };
  h.on_topology = [this](const net::TopologyMessage& message) {
    topology = message;
    news |= kBrachydNewTopology;
  };
  h.on_frame = [this](const net::FrameMessage& message) {
    frame = c_api::frame_of(message);
    frame->seed_count = static_cast<std::uint32_t>(client->mesh().seeds().size());
    needles.clear();
    for (const net::NeedleRecord& record : message.needles) needles.push_back(c_api::needle_of(record));
    news |= kBrachydNewFrame;
  };
  h.on_force = [this](const net::ForceMessage& message) {
    force = c_api::force_of(message, net::real_clock().now_ns());
    news |= kBrachydNewForce;
  };
  h.on_state = [this](const net::StateMessage& message) {
    state = c_api::state_of(message);
    news |= kBrachydNewState;
  };
  h.on_event = [this](const net::EventMessage& message) {
    if (events.size() == kMostWaiting) events.pop_front();
    events.push_back(c_api::event_of(message));
    news |= kBrachydNewEvent;
  };
  h.on_error = [this](const net::ErrorMessage& message) {
    if (errors.size() == kMostWaiting) errors.pop_front();
    errors.push_back(c_api::error_of(message));
    if (message.fatal) {
      is_refused = true;
      closed_reason = message.text;
    }
    news |= kBrachydNewError;
  };
  h.on_image = [this](const net::ImageMessage& message) {
    const auto array = static_cast<int>(message.array);
    if (array < kBrachydTransverse || array > kBrachydEndFire) return;  // of a later version
    c_api::ReceivedImage received;
    if (!net::read_pixels(message, received.pixels).empty()) return;  // what is set stays shown
    received.message = message;
    received.message.data.clear();
    images[static_cast<std::size_t>(array - 1)] = std::move(received);
    newest_image = array;
    news |= kBrachydNewImage;
  };
  h.on_scanner = [this](const net::ScannerMessage& message) {
    scanner = c_api::scanner_of(message);
    news |= kBrachydNewScanner;
  };
  h.on_closed = [this](const std::string& reason) { closed_reason = reason; };
  return h;
}

void BrachydClient::forget() {
  client.reset();
  is_refused = false;
  closed_reason.clear();
  news = 0;
  welcome.reset();
  topology.reset();
  frame.reset();
  needles.clear();
  force.reset();
  state.reset();
  scanner.reset();
  events.clear();
  errors.clear();
  images = {};
  newest_image = 0;
}
