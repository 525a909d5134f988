// Adapter for a Haply Inverse3, through Haply's own service, which runs beside it (ws://127.0.0.1:10001): each message
// that it is sent, a force, is answered by one with the device's state, in metres and newtons.
//
//   haply_device HOST:PORT [--service HOST:PORT] [--dialect vector|values] [--device ID] [--needle N] [--token FILE] …
//
// The service's versions differ in the key below set_cursor_force: "vector" (3.x) or "values" (2.x). A VerseGrip's
// first button drops seeds. The needle keeps the direction of the world's +z: the Inverse3 has three axes.
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/examples/hand_adapter.h"
#include "core/base/error.h"

namespace {

using namespace brachy;
namespace asio = boost::asio;
namespace beast = boost::beast;
using Json = nlohmann::json;

constexpr const char* kUsage =
    "usage: haply_device HOST:PORT [--service HOST:PORT] [--dialect vector|values] [--device ID] [--needle "
    "N] "
    "[--token FILE] [--scale S] [--start X,Y,Z] [--seconds S]";
constexpr double kMmPerM = 1000;
constexpr double kMaxForceN = 8;  // what the Inverse3 renders for longer than a moment
constexpr auto kLongestAnswer = std::chrono::milliseconds(20);

/// The service's x is right, y away from the user, z up; the needle goes in along the world's +z, away from the user.
Mat3 inverse3_in_world() {
  Mat3 R;
  R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return R;
}

class Inverse3 final : public HandDevice {
 public:
  Inverse3(const std::string& service, std::string dialect, std::string device)
      : dialect_(std::move(dialect)), device_(std::move(device)) {
    const std::size_t colon = service.rfind(':');
    boost::system::error_code error;
    asio::ip::tcp::resolver resolver(io_);
    if (colon != std::string::npos) {
      const auto found = resolver.resolve(service.substr(0, colon), service.substr(colon + 1), error);
      if (!error) asio::connect(beast::get_lowest_layer(stream_).socket(), found, error);
      if (!error) beast::get_lowest_layer(stream_).socket().set_option(asio::ip::tcp::no_delay(true), error);
      if (!error) stream_.handshake(service, "/", error);
    }
    if (colon == std::string::npos || error)
      throw UserError("no Haply service at " + service + " (" + error.message() +
                      "): start it, or name it by --service");
    HandReading first;
    if (!read(first))
      throw UserError("the Haply service at " + service +
                      " sends no state of an Inverse3: is one plugged in?");
  }

  HandDeviceFacts facts() const override { return {"haply_device", kMaxForceN, 0.0005, 1000}; }

  bool exchange(const Vec3& force_n, HandReading& reading) override {
    const Json vector{{"x", force_n.x()}, {"y", force_n.y()}, {"z", force_n.z()}};
    const Json command{
        {"inverse3", Json::array({{{"device_id", device_},
                                   {"commands", {{"set_cursor_force", {{dialect_, vector}}}}}}})}};
    const std::string text = command.dump();
    boost::system::error_code error;
    stream_.write(asio::buffer(text), error);
    return !error && read(reading);
  }

 private:
  /// One message of the service; false: none within kLongestAnswer, or it is none of an Inverse3.
  bool read(HandReading& reading) {
    beast::flat_buffer buffer;
    bool has_come = false;
    stream_.async_read(buffer,
                       [&](const boost::system::error_code& error, std::size_t) { has_come = !error; });
    io_.restart();
    io_.run_for(kLongestAnswer);
    if (!has_come) {
      beast::get_lowest_layer(stream_).cancel();
      io_.restart();
      io_.run();  // what waited ends here, before the buffer does
      return false;
    }
    const Json state = Json::parse(beast::buffers_to_string(buffer.data()), nullptr, false);
    return !state.is_discarded() && take(state, reading);
  }

  bool take(const Json& message, HandReading& reading) {
    const Json none;
    const Json& devices = message.contains("inverse3") ? message["inverse3"] : none;
    for (const Json& one : devices) {
      const std::string id = one.value("device_id", "");
      if (device_.empty()) device_ = id;
      const Json::json_pointer position("/state/cursor_position");
      if (id != device_ || !one.contains(position)) continue;
      const Json& p = one[position];
      for (int i = 0; i < 3; ++i) {
        const char axis[] = {"xyz"[i], 0};
        if (!p.contains(axis) || !p[axis].is_number()) return false;
        reading.X_DN.p[i] = kMmPerM * p[axis].get<double>();
      }
      reading.button = button_of(message);
      return true;
    }
    return false;
  }

  /// Of a VerseGrip, whichever the service has.
  static bool button_of(const Json& message) {
    for (const char* grips : {"wireless_verse_grip", "verse_grip"})
      if (message.contains(grips))
        for (const Json& grip : message[grips])
          for (const char* place : {"/state/buttons/a", "/state/button"})
            if (const Json::json_pointer at(place);
                grip.contains(at) && grip[at].is_boolean() && grip[at].get<bool>())
              return true;
    return false;
  }

  asio::io_context io_{1};
  beast::websocket::stream<beast::tcp_stream> stream_{io_};
  const std::string dialect_;
  std::string device_;  // its id; empty: the first
};

}  // namespace

int main(int argc, char** argv) try {
  AdapterLine line = adapter_line(argc, argv, kUsage, {"--service", "--dialect", "--device"});
  const auto own = [&](const char* name, const char* otherwise) {
    return line.own.contains(name) ? line.own[name] : std::string(otherwise);
  };
  const std::string dialect = own("--dialect", "vector");
  if (dialect != "vector" && dialect != "values") throw UserError(kUsage);
  line.mapping.R_WD = inverse3_in_world();
  Inverse3 device(own("--service", "127.0.0.1:10001"), dialect, own("--device", ""));
  return run_hand_adapter(device, line);
} catch (const std::exception& e) {
  std::fprintf(stderr, "haply_device: %s\n", e.what());
  return 2;
}
