#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "net/base/clock.h"
#include "net/transport/connection.h"
#include "net/wire/messages.h"

namespace brachy::net {

/// A viewer in this process: the connection that a Server sends to, and its client. It passes each message on; the next
/// one is passed after done(). Threads: the io thread.
class InProcessViewer final : public Connection, public std::enable_shared_from_this<InProcessViewer> {
 public:
  /// A message, header and body as on the wire; released with done().
  using OnMessage = std::function<void(Bytes header, std::shared_ptr<const Bytes> body)>;
  using OnClosed = std::function<void()>;
  /// Posts its argument to the io thread; never calls it at once.
  using Post = std::function<void(std::function<void()>)>;

  /// `subscription`: of its HELLO. `on_closed`: the server ended it.
  InProcessViewer(Clock& clock, std::string name, std::uint32_t subscription, Post post, OnMessage on_message,
                  OnClosed on_closed);

  void done();   ///< releases the last message
  void leave();  ///< no call of on_message or on_closed after it

  void start(std::shared_ptr<ConnectionListener> listener) override;
  void write(Bytes header, std::shared_ptr<const Bytes> body) override;
  void shutdown_send() override;
  void close() override;
  std::int64_t last_progress_ns() const override { return last_progress_ns_; }
  std::int64_t last_waited_progress_ns() const override { return 0; }
  std::size_t unsent_bytes() const override { return 0; }
  const std::string& peer() const override { return name_; }

 private:
  Clock& clock_;
  const std::string name_;
  const std::uint32_t subscription_;
  const Post post_;
  OnMessage on_message_;
  OnClosed on_closed_;
  std::shared_ptr<ConnectionListener> listener_;  // null once closed
  std::int64_t last_progress_ns_ = 0;
};

}  // namespace brachy::net
