#include "tests/faults/faults_testing.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <filesystem>
#include <iterator>
#include <utility>

namespace brachy::test {

namespace asio = boost::asio;
using asio::ip::tcp;

std::size_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all))) - 1;  // its own
}

Talker::Talker(asio::io_context& io, std::uint16_t port, std::vector<net::Bytes> parts)
    : socket_(io), parts_(std::move(parts)), buffer_(16 * 1024) {
  socket_.connect({asio::ip::address_v4::loopback(), port});
  socket_.set_option(tcp::no_delay(true));
}

void Talker::start() {
  say();
  listen();
}

void Talker::close() {
  boost::system::error_code ignored;
  socket_.close(ignored);
}

void Talker::say() {
  if (is_saying_ || is_ended_ || has_said_all()) return;
  is_saying_ = true;
  asio::async_write(socket_, asio::buffer(parts_[said_]),
                    [self = shared_from_this()](const boost::system::error_code& error, std::size_t) {
                      self->is_saying_ = false;
                      if (!error) ++self->said_;
                    });
}

void Talker::listen() {
  socket_.async_read_some(
      asio::buffer(buffer_),
      [self = shared_from_this()](const boost::system::error_code& error, std::size_t size) {
        self->received_ += size;
        if (error) {
          self->is_ended_ = true;
          return self->close();
        }
        self->say();
        self->listen();
      });
}

net::ServerOptions FaultsFixture::short_timeouts() {
  net::ServerOptions o;
  o.needles = 400;
  o.max_clients = o.max_clients_per_address = 1000;
  o.hello_timeout = std::chrono::milliseconds(250);
  o.silence_timeout = std::chrono::milliseconds(400);
  o.stall_timeout = std::chrono::milliseconds(400);
  o.ping_interval = std::chrono::milliseconds(100);
  o.drain_timeout = std::chrono::milliseconds(100);
  o.send_buffer_bytes = 4096;
  return o;
}

void FaultsFixture::start_all(net::ServerOptions options) {
  start(options);
  const auto to_log = [this](const std::string& line) { log.push_back(line); };
  net::HttpOptions http_options;
  http_options.request_timeout = http_options.answer_timeout = std::chrono::milliseconds(150);
  http.emplace(io, *server, http_options, net::ServedFiles{}, to_log);
  net::igtl::IgtlOptions igtl_options;
  igtl_options.first_message_wait = std::chrono::milliseconds(50);
  igtl.emplace(io, igtl_options, *server, tissue, to_log);
}

void FaultsFixture::publish_all() {
  simulation.step();
  server->publish(simulation.snapshot());
  igtl->publish(simulation.snapshot());
}

void FaultsFixture::publish_now_and_then(const net::test::Recorder* reader) {
  if (reader && !reader->frames.empty() && reader->frames.back().tick != simulation.state().summary.tick)
    return;
  if (std::exchange(published_ns_, clock.now_ns()) != clock.now_ns()) publish_all();
}

void FaultsFixture::expect_a_good_client_is_served() {
  const auto viewer = join_as(net::Role::kViewer, "good");
  publish_all();
  EXPECT_TRUE(until([&] {
    return !viewer->frames.empty() && viewer->frames.back().tick == simulation.state().summary.tick;
  })) << (viewer->closed.empty() ? "no frame" : viewer->closed.back());
  EXPECT_EQ(viewer->client.mesh().positions(), simulation.state().mesh.deformed_vertices);
  viewer->client.close();
  EXPECT_TRUE(until([&] { return server->client_count() == 0; }));
}

bool FaultsFixture::has_no_lease() const {
  for (std::uint16_t needle = 0; needle < server->options().needles; ++needle)
    if (!server->lease_holder(needle).empty()) return false;
  return true;
}

}  // namespace brachy::test
