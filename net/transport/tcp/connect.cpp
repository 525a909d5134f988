#include "net/transport/tcp/connect.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/error.hpp>

#include "core/base/error.h"

namespace brachy::net {
namespace asio = boost::asio;
using asio::ip::tcp;

tcp::socket connect_tcp(asio::io_context& io, const std::string& host, std::uint16_t port, TimerClock& clock,
                        std::chrono::milliseconds timeout) {
  const std::string server = host + ":" + std::to_string(port);
  asio::io_context local;  // separate, so that no other handler runs meanwhile
  boost::system::error_code error;
  const auto endpoints = tcp::resolver(local).resolve(host, std::to_string(port), error);
  if (error) throw UserError("cannot find the host '" + host + "': " + error.message());
  tcp::socket socket(local);
  bool is_late = false;
  tcp::endpoint endpoint;
  const std::unique_ptr<Timer> timer = clock.make_timer(local);
  timer->start(timeout, [&] {
    is_late = true;
    boost::system::error_code ignored;
    socket.close(ignored);
  });
  asio::async_connect(socket, endpoints,
                      [&](const boost::system::error_code& result, const tcp::endpoint& reached) {
                        error = result;
                        endpoint = reached;
                        timer->cancel();
                      });
  local.run();
  if (error == asio::error::connection_refused) {
    throw UserError("nothing listens on " + server + ": start brachyd first, or give the port it printed");
  }
  if (is_late || error == asio::error::timed_out)
    throw UserError("no answer from " + server + " within " + std::to_string(timeout.count()) + " ms");
  if (error) throw UserError("cannot connect to " + server + ": " + error.message());
  tcp::socket moved(io);
  moved.assign(endpoint.protocol(), socket.release());
  return moved;
}

}  // namespace brachy::net
