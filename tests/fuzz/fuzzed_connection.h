#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "net/base/clock.h"
#include "net/transport/connection.h"
#include "tests/fuzz/fuzzing.h"

namespace brachy::fuzz {

/// A connection without a socket. The fuzzer determines what it receives, and when its writes complete.
class FuzzedConnection final : public net::Connection {
 public:
  using Hear = std::function<void(std::span<const std::byte>)>;

  /// `hear` receives what the server sends.
  explicit FuzzedConnection(Hear hear) : hear_(std::move(hear)) {}

  // For the fuzzer. No effect once the server has closed.
  void feed(std::span<const std::byte> bytes) {
    if (const auto listener = listener_) listener->on_bytes(bytes);
  }
  void feed_message(std::span<const std::byte> bytes) {
    if (const auto listener = listener_) listener->on_message(bytes);
  }
  /// Completes the pending write; false where there is none.
  bool finish_write() {
    if (!listener_ || !std::exchange(is_writing_, false)) return false;
    const auto listener = listener_;
    listener->on_written();
    return true;
  }
  void leave() {
    if (const auto listener = std::exchange(listener_, nullptr)) listener->on_closed("left");
  }
  void set_unsent_bytes(std::size_t bytes) { unsent_bytes_ = bytes; }
  bool is_open() const { return listener_ != nullptr; }
  bool is_shut() const { return is_shut_; }

  // For the server.
  void start(std::shared_ptr<net::ConnectionListener> listener) override { listener_ = std::move(listener); }
  void write(net::Bytes header, std::shared_ptr<const net::Bytes> body) override {
    EXPECT_TRUE(listener_) << "a write after close()";
    EXPECT_FALSE(is_writing_) << "a write while another goes on";
    EXPECT_FALSE(is_shut_) << "a write after shutdown_send()";
    is_writing_ = true;
    hear_(header);
    if (body) hear_(*body);
  }
  void shutdown_send() override { is_shut_ = true; }
  void close() override { listener_ = nullptr; }
  std::int64_t last_progress_ns() const override { return monotonic_ns(); }
  std::int64_t last_waited_progress_ns() const override { return 0; }
  std::size_t unsent_bytes() const override { return unsent_bytes_; }
  const std::string& peer() const override { return peer_; }

 private:
  const Hear hear_;
  const std::string peer_ = "fuzzer:1";
  std::shared_ptr<net::ConnectionListener> listener_;  // null before start and once closed
  std::size_t unsent_bytes_ = 0;
  bool is_writing_ = false;
  bool is_shut_ = false;
};

}  // namespace brachy::fuzz
