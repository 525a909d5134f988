#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "net/c_api/c_structs.h"

namespace brachy::net::c_api {

struct ReceivedImage {
  ImageMessage message;
  std::vector<std::uint8_t> pixels;
};

}  // namespace brachy::net::c_api

/// What came last by one connection; `client` is first destroyed, since its handlers write all the rest.
struct BrachydClient {
  mutable std::string error_text;
  bool is_refused = false;    // by a fatal ERROR
  std::string closed_reason;  // empty: the connection did not end by itself
  int news = 0;
  std::optional<BrachydWelcome> welcome;
  std::optional<brachy::net::TopologyMessage> topology;
  std::optional<BrachydFrame> frame;
  std::vector<BrachydNeedle> needles;
  std::optional<BrachydForce> force;
  std::optional<BrachydState> state;
  std::optional<BrachydScanner> scanner;
  std::deque<BrachydEvent> events;
  std::deque<BrachydError> errors;
  /// Of kBrachydTransverse, kBrachydSagittal, kBrachydEndFire.
  std::array<brachy::net::c_api::ReceivedImage, 3> images;
  int newest_image = 0;  // array of it; 0: none
  boost::asio::io_context io{1};
  std::unique_ptr<brachy::net::Client> client;

  brachy::net::ClientHandlers handlers();
  /// Ends the connection and drops all that came.
  void forget();
  /// Runs what is ready.
  void run_ready();
  /// Runs until `is_done` or that time has passed.
  template <class Condition>
  void run_until(const Condition& is_done, double seconds) {
    using namespace brachy::net;
    const std::int64_t end_ns = real_clock().now_ns() + in_ns(c_api::in_ms(seconds));
    if (io.stopped()) io.restart();
    run_ready();
    while (!is_done()) {
      const std::int64_t left_ns = end_ns - real_clock().now_ns();
      if (left_ns <= 0 || io.run_one_for(std::chrono::nanoseconds(left_ns)) == 0) break;
      run_ready();
    }
  }
};
