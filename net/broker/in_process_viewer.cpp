#include "net/broker/in_process_viewer.h"

#include "net/wire/codec.h"

namespace brachy::net {

InProcessViewer::InProcessViewer(Clock& clock, std::string name, std::uint32_t subscription, Post post,
                                 OnMessage on_message, OnClosed on_closed)
    : clock_(clock),
      name_(std::move(name)),
      subscription_(subscription),
      post_(std::move(post)),
      on_message_(std::move(on_message)),
      on_closed_(std::move(on_closed)) {}

void InProcessViewer::start(std::shared_ptr<ConnectionListener> listener) {
  listener_ = std::move(listener);
  post_([self = shared_from_this()] {
    const auto server = self->listener_;
    if (!server) return;
    HelloMessage hello;
    hello.role = Role::kViewer;
    hello.subscription = self->subscription_;
    hello.name = self->name_;
    Bytes bytes;
    encode(hello, 1, self->clock_.now_ns(), bytes);
    server->on_bytes(bytes);
  });
}

void InProcessViewer::write(Bytes header, std::shared_ptr<const Bytes> body) {
  last_progress_ns_ = clock_.now_ns();
  if (on_message_) on_message_(std::move(header), std::move(body));
}

void InProcessViewer::done() {
  if (const auto server = listener_) server->on_written();
}

void InProcessViewer::shutdown_send() {
  post_([self = shared_from_this()] { self->leave(); });
}

void InProcessViewer::close() {
  on_message_ = nullptr;
  listener_ = nullptr;
  if (const auto on_closed = std::exchange(on_closed_, nullptr)) on_closed();
}

void InProcessViewer::leave() {
  on_message_ = nullptr;
  on_closed_ = nullptr;
  if (const auto server = std::exchange(listener_, nullptr)) server->on_closed("left");
}

}  // namespace brachy::net
