#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "net/transport/connection.h"
#include "net/wire/codec.h"
#include "tests/net/raw_peer.h"

namespace brachy::net::test {

/// A connection without a socket, with the peer at its other end. A write completes when the peer reads.
class FakeConnection final : public Connection, public Heard {
 public:
  explicit FakeConnection(TimerClock& clock) : clock_(clock) {}

  // The peer.

  /// Sends messages in one piece, and does not read.
  template <class... Messages>
  void send_together(const Messages&... messages) {
    Bytes bytes;
    (encode(messages, ++sent_, clock_.now_ns(), bytes), ...);
    receive(bytes);
  }
  void send_header_and_body(MessageType type, const Bytes& body) {
    Bytes bytes;
    encode_header(
        {kProtocolVersion, type, 0, static_cast<std::uint32_t>(body.size()), ++sent_, clock_.now_ns()},
        bytes);
    bytes.insert(bytes.end(), body.begin(), body.end());
    receive(bytes);
  }
  void read_all() {
    while (std::exchange(is_writing_, false) && listener_) std::shared_ptr(listener_)->on_written();
  }
  void leave() {
    if (const auto listener = std::exchange(listener_, nullptr)) listener->on_closed("closed by the peer");
  }
  std::uint64_t sent() const { return sent_; }  ///< messages; the last one's sequence
  bool is_closed() const { return listener_ == nullptr; }
  bool is_shut() const { return is_shut_; }

  // For the session.

  void start(std::shared_ptr<ConnectionListener> listener) override { listener_ = std::move(listener); }
  void write(Bytes header, std::shared_ptr<const Bytes> body) override {
    EXPECT_FALSE(is_writing_ || is_shut_ || is_closed());
    is_writing_ = true;
    written_ns_ = clock_.now_ns();
    hear(header);
    hear(*body);
  }
  void shutdown_send() override { is_shut_ = true; }
  void close() override { listener_ = nullptr; }
  std::int64_t last_progress_ns() const override { return written_ns_; }
  std::int64_t last_waited_progress_ns() const override { return 0; }
  std::size_t unsent_bytes() const override { return 0; }
  const std::string& peer() const override { return peer_; }

 private:
  void receive(const Bytes& bytes) {
    if (const auto listener = listener_) listener->on_bytes(bytes);
  }

  TimerClock& clock_;
  const std::string peer_ = "10.0.0.7:5000";
  std::shared_ptr<ConnectionListener> listener_;  // null before start() and once closed
  std::uint64_t sent_ = 0;
  std::int64_t written_ns_ = 0;
  bool is_writing_ = false, is_shut_ = false;
};

}  // namespace brachy::net::test
