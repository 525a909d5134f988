#include "net/transport/tcp/tcp_link.h"

#include <boost/asio/connect.hpp>
#include <charconv>
#include <utility>

#include "core/base/error.h"

namespace brachy::net {
namespace asio = boost::asio;
namespace {

// A machine that is switched off answers nothing: connect would wait for minutes.
constexpr std::chrono::seconds kLongestAttempt{3};

}  // namespace

std::string LinkTarget::text() const {
  const bool is_ipv6 = host.find(':') != std::string::npos;
  return (is_ipv6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

LinkTarget link_target(const std::string& text, const std::string& what) {
  const std::size_t colon = text.rfind(':');
  LinkTarget target;
  if (colon != std::string::npos) {
    target.host = text.substr(0, colon);
    if (target.host.starts_with('[') && target.host.ends_with(']'))
      target.host = target.host.substr(1, target.host.size() - 2);
    const char* const end = text.data() + text.size();
    const auto [last, error] = std::from_chars(text.data() + colon + 1, end, target.port);
    if (error == std::errc() && last == end && target.port > 0 && !target.host.empty()) return target;
  }
  throw UserError(what + ": '" + text + "' is not HOST:PORT, such as 127.0.0.1:18945");
}

TcpLink::TcpLink(asio::io_context& io, TimerClock& clock, LinkTarget target, Handlers handlers)
    : target_(std::move(target)),
      handlers_(std::move(handlers)),
      resolver_(io),
      socket_(io),
      clock_(clock),
      timer_(clock.make_timer(io)) {}

void TcpLink::start() {
  connect();
}

void TcpLink::on_ended() {
  retry_.failed(clock_.now_ns());
  wait();
}

void TcpLink::stop() {
  is_stopped_ = true;
  resolver_.cancel();
  timer_->cancel();
  boost::system::error_code ignored;
  socket_.close(ignored);
}

void TcpLink::connect() {
  ++attempts_;
  boost::system::error_code error;
  const auto address = asio::ip::make_address(target_.host, error);
  if (!error) {
    const asio::ip::tcp::endpoint endpoint(address, target_.port);
    return on_resolved(asio::ip::tcp::resolver::results_type::create(endpoint, target_.host, ""));
  }
  resolver_.async_resolve(target_.host, std::to_string(target_.port),
                          [self = shared_from_this()](const auto& failure, const auto& endpoints) {
                            if (self->is_stopped_) return;
                            failure ? self->failed(failure.message()) : self->on_resolved(endpoints);
                          });
}

void TcpLink::on_resolved(const asio::ip::tcp::resolver::results_type& endpoints) {
  timer_->start(kLongestAttempt, [self = shared_from_this()] {
    boost::system::error_code ignored;
    self->socket_.close(ignored);
  });
  asio::async_connect(socket_, endpoints,
                      [self = shared_from_this()](const boost::system::error_code& error, const auto&) {
                        self->timer_->cancel();
                        if (self->is_stopped_) return;
                        if (error) return self->failed(error.message());
                        self->retry_.connected();
                        self->is_reported_ = false;
                        self->handlers_.on_connected(std::move(self->socket_));
                      });
}

void TcpLink::failed(const std::string& why) {
  if (!std::exchange(is_reported_, true))
    handlers_.log("cannot connect to " + target_.text() + ": " + why + "; trying again");
  retry_.failed(clock_.now_ns());
  wait();
}

void TcpLink::wait() {
  if (is_stopped_) return;
  boost::system::error_code ignored;
  socket_.close(ignored);
  timer_->start(std::chrono::nanoseconds(retry_.wait_ns(clock_.now_ns())), [self = shared_from_this()] {
    if (!self->is_stopped_) self->connect();
  });
}

}  // namespace brachy::net
