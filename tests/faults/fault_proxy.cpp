#include "tests/faults/fault_proxy.h"

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <cstddef>
#include <utility>

namespace brachy::test {

namespace asio = boost::asio;
using asio::ip::tcp;
using Error = boost::system::error_code;

/// A client's connection and the corresponding one to the server.
class FaultProxy::Link : public std::enable_shared_from_this<Link> {
 public:
  Link(asio::io_context& io, net::TimerClock& clock, tcp::socket client, std::uint16_t server_port,
       const Faults& faults)
      : client_(std::move(client)),
        server_(io),
        cut_(faults.cut),
        lanes_{Lane(clock.make_timer(io), faults.up, client_, server_),
               Lane(clock.make_timer(io), faults.down, server_, client_)} {
    Error error;
    server_.open(tcp::v4(), error);
    if (faults.receive_buffer > 0)
      server_.set_option(asio::socket_base::receive_buffer_size(faults.receive_buffer), error);
    server_.connect({asio::ip::address_v4::loopback(), server_port}, error);
    client_.set_option(tcp::no_delay(true), error);
    server_.set_option(tcp::no_delay(true), error);
  }

  void start() {
    for (Lane& lane : lanes_) read(lane);
  }
  void cut(Cut how) {
    if (phase_ != Phase::kPassing) return;
    for (Lane& lane : lanes_) lane.timer->cancel();
    Error ignored;
    if (how == Cut::kSilence) {
      phase_ = Phase::kSilent;
      for (tcp::socket* socket : {&client_, &server_}) socket->cancel(ignored);
    } else if (how == Cut::kReset) {
      reset();
    } else {
      // Further data are read and discarded until either end has closed too: closing earlier would cause a RST.
      phase_ = Phase::kDraining;
      for (tcp::socket* socket : {&client_, &server_}) {
        socket->cancel(ignored);
        socket->shutdown(tcp::socket::shutdown_send, ignored);
      }
      for (Lane& lane : lanes_) drain(lane);
    }
  }
  void close() {
    phase_ = Phase::kClosed;
    Error ignored;
    for (Lane& lane : lanes_) lane.timer->cancel();
    for (tcp::socket* socket : {&client_, &server_}) socket->close(ignored);
  }
  std::uint64_t passed(std::size_t lane) const { return lanes_[lane].passed; }

 private:
  enum class Phase { kPassing, kSilent, kDraining, kClosed };
  struct Lane {
    Lane(std::unique_ptr<net::Timer> delay, const Way& given, tcp::socket& source, tcp::socket& sink)
        : way(given),
          from(source),
          to(sink),
          timer(std::move(delay)),
          buffer(std::max<std::size_t>(given.piece, 1)) {}
    const Way way;
    tcp::socket& from;
    tcp::socket& to;
    std::unique_ptr<net::Timer> timer;
    std::vector<std::byte> buffer;
    std::uint64_t passed = 0;
    bool has_ended = false;
  };

  void read(Lane& lane) {
    if (phase_ != Phase::kPassing) return;
    if (lane.passed == lane.way.cut_after) return cut(cut_);
    const auto most = std::min<std::uint64_t>(lane.buffer.size(), lane.way.cut_after - lane.passed);
    lane.from.async_read_some(asio::buffer(lane.buffer, static_cast<std::size_t>(most)),
                              [self = shared_from_this(), &lane](const Error& error, std::size_t size) {
                                if (self->phase_ != Phase::kPassing) return;
                                if (error) return self->source_ended(lane, error);
                                if (lane.way.delay.count() == 0) return self->pass_on(lane, size);
                                lane.timer->start(lane.way.delay,
                                                  [self, &lane, size] { self->pass_on(lane, size); });
                              });
  }

  void pass_on(Lane& lane, std::size_t size) {
    if (phase_ != Phase::kPassing) return;
    asio::async_write(lane.to, asio::buffer(lane.buffer, size),
                      [self = shared_from_this(), &lane](const Error& error, std::size_t written) {
                        lane.passed += written;
                        if (self->phase_ != Phase::kPassing) return;
                        error ? self->reset() : self->read(lane);
                      });
  }

  void source_ended(Lane& lane, const Error& error) {
    if (error != asio::error::eof) return reset();
    lane.has_ended = true;
    Error ignored;
    lane.to.shutdown(tcp::socket::shutdown_send, ignored);
    if (lanes_[0].has_ended && lanes_[1].has_ended) close();
  }

  void drain(Lane& lane) {
    lane.from.async_read_some(asio::buffer(lane.buffer),
                              [self = shared_from_this(), &lane](const Error& error, std::size_t) {
                                if (self->phase_ != Phase::kDraining) return;
                                if (!error) return self->drain(lane);
                                lane.has_ended = true;
                                if (self->lanes_[0].has_ended && self->lanes_[1].has_ended) self->close();
                              });
  }

  void reset() {
    Error ignored;
    for (tcp::socket* socket : {&client_, &server_})
      socket->set_option(asio::socket_base::linger(true, 0), ignored);
    close();
  }

  tcp::socket client_, server_;
  const Cut cut_;
  std::array<Lane, 2> lanes_;  // up, down
  Phase phase_ = Phase::kPassing;
};

FaultProxy::FaultProxy(asio::io_context& io, net::TimerClock& clock, std::uint16_t server_port)
    : io_(io),
      clock_(clock),
      acceptor_(io, {asio::ip::address_v4::loopback(), 0}),
      server_port_(server_port) {
  accept_next();
}

FaultProxy::~FaultProxy() {
  clear();
}

void FaultProxy::accept_next() {
  acceptor_.async_accept([this](const Error& error, tcp::socket socket) {
    if (error) return;  // closed: `this` may be gone
    links_.push_back(std::make_shared<Link>(io_, clock_, std::move(socket), server_port_,
                                            plan ? plan(links_.size()) : next));
    links_.back()->start();
    accept_next();
  });
}

std::uint64_t FaultProxy::passed_up(std::size_t number) const {
  return links_.at(number)->passed(0);
}
std::uint64_t FaultProxy::passed_down(std::size_t number) const {
  return links_.at(number)->passed(1);
}
void FaultProxy::cut(std::size_t number, Cut how) {
  links_.at(number)->cut(how);
}
void FaultProxy::clear() {
  for (const auto& link : links_) link->close();
  links_.clear();
}

}  // namespace brachy::test
