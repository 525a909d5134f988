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
#include <optional>
#include <string>
#include <utility>

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
constexpr auto kLongestFirst = std::chrono::milliseconds(2000);
constexpr auto kLongestHandshake = std::chrono::milliseconds(200);
constexpr auto kRetry = std::chrono::seconds(1);

/// The service's words for a device: a text, or in some versions a number.
std::string text_of_id(const Json& id) {
  return id.is_string() ? id.get<std::string>() : id.dump();
}

/// Whatever the service sends, late, about other devices, or of another kind altogether, the device is only not there
/// until its next state; a service that ended is tried again.
class Inverse3 final : public HandDevice {
 public:
  Inverse3(std::string service, std::string dialect, const std::string& device)
      : service_(std::move(service)), dialect_(std::move(dialect)), wanted_(device) {
    if (const std::string why = connect(); !why.empty())
      throw UserError("no Haply service at " + service_ + " (" + why +
                      "): start it, or name it by --service");
    HandReading first;
    if (!read_newest(first, kLongestFirst))
      throw UserError("the Haply service at " + service_ +
                      " sends no state of an Inverse3: is one plugged in?");
  }

  HandDeviceFacts facts() const override { return {"haply_device", kMaxForceN, 0.0005, 1000}; }

  bool exchange(const Vec3& force_n, HandReading& reading) override {
    if (!stream_ && !connect_again()) return true;
    const Json vector{{"x", force_n.x()}, {"y", force_n.y()}, {"z", force_n.z()}};
    const Json command{
        {"inverse3",
         Json::array({{{"device_id", id_}, {"commands", {{"set_cursor_force", {{dialect_, vector}}}}}}})}};
    const std::string text = command.dump();
    boost::system::error_code error;
    stream_->write(asio::buffer(text), error);
    if (error) lose("the service does not read: " + error.message());
    note(stream_ && read_newest(reading));
    return true;
  }

 private:
  using Stream = beast::websocket::stream<beast::tcp_stream>;
  using TimePoint = std::chrono::steady_clock::time_point;

  /// "", or why not.
  std::string connect() {
    const std::size_t colon = service_.rfind(':');
    if (colon == std::string::npos) return "it is no HOST:PORT";
    boost::system::error_code error;
    const auto found =
        asio::ip::tcp::resolver(io_).resolve(service_.substr(0, colon), service_.substr(colon + 1), error);
    stream_.emplace(io_);
    auto& socket = beast::get_lowest_layer(*stream_).socket();
    if (!error) asio::connect(socket, found, error);
    if (!error) socket.set_option(asio::ip::tcp::no_delay(true), error);
    if (!error) {
      error = asio::error::timed_out;
      stream_->async_handshake(service_, "/", [&](const boost::system::error_code& e) { error = e; });
      run_for(kLongestHandshake);
      if (error == asio::error::timed_out) cancel();
    }
    if (error) {
      stream_.reset();
      return error.message();
    }
    buffer_.clear();
    read_next();
    return "";
  }

  bool connect_again() {
    const auto now = std::chrono::steady_clock::now();
    if (now - tried_ < kRetry) return false;
    tried_ = now;
    if (!connect().empty()) return false;
    std::fprintf(stderr, "haply_device: the service is there again\n");
    return true;
  }

  void lose(const std::string& why) {
    std::fprintf(stderr, "haply_device: %s; no force until it is there again\n", why.c_str());
    cancel();
    stream_.reset();
    tried_ = std::chrono::steady_clock::now();
  }

  /// Says once that the device's states end and when they come again.
  void note(bool is_there) {
    if (is_there == is_there_) return;
    if (stream_)
      std::fprintf(
          stderr, "haply_device: %s\n",
          is_there ? "the device is there again" : "the device sends no state; no force until it does");
    is_there_ = is_there;
  }

  void run_for(std::chrono::milliseconds time) {
    io_.restart();
    io_.run_for(time);
  }
  /// What waits on the stream ends here, before the stream does.
  void cancel() {
    beast::get_lowest_layer(*stream_).close();
    io_.restart();
    io_.run();
  }

  /// Reads on, across cycles: a state that is late for its own is there for the next.
  void read_next() {
    stream_->async_read(buffer_, [this](const boost::system::error_code& error, std::size_t) {
      if (error) {
        read_error_ = error;
        return;
      }
      const Json message = Json::parse(beast::buffers_to_string(buffer_.data()), nullptr, false);
      buffer_.consume(buffer_.size());
      if (auto reading = reading_of(message)) newest_ = reading;
      read_next();
    });
  }

  /// The newest state of the device; false: none has come within `wait`.
  bool read_newest(HandReading& reading, std::chrono::milliseconds wait = kLongestAnswer) {
    newest_.reset();
    read_error_ = {};
    const TimePoint end = std::chrono::steady_clock::now() + wait;
    io_.restart();
    while (!newest_ && !read_error_ && io_.run_one_until(end) > 0) {
    }
    io_.poll();  // what waits besides is newer
    if (newest_) reading = *newest_;
    const bool has_come = newest_.has_value();
    if (read_error_) lose("the service ended: " + read_error_.message());
    return has_come;
  }

  /// nullopt: the message holds no state of the device.
  std::optional<HandReading> reading_of(const Json& message) {
    if (!message.is_object() || !message.contains("inverse3")) return std::nullopt;
    for (const Json& one : message["inverse3"]) {
      if (!one.is_object() || !one.contains("device_id")) continue;
      const Json& id = one["device_id"];
      if (wanted_.empty()) wanted_ = text_of_id(id);
      const Json::json_pointer position("/state/cursor_position");
      if (text_of_id(id) != wanted_ || !one.contains(position)) continue;
      const Json& p = one[position];
      HandReading reading;
      for (int i = 0; i < 3; ++i) {
        const char axis[] = {"xyz"[i], 0};
        if (!p.is_object() || !p.contains(axis) || !p[axis].is_number()) return std::nullopt;
        reading.p_DN[i] = kMmPerM * p[axis].get<double>();
      }
      id_ = id;
      reading.button = button_of(message);
      return reading;
    }
    return std::nullopt;
  }

  /// Of a VerseGrip, whichever the service has.
  static bool button_of(const Json& message) {
    for (const char* grips : {"wireless_verse_grip", "verse_grip"})
      if (message.contains(grips))
        for (const Json& grip : message[grips])
          for (const char* place : {"/state/buttons/a", "/state/button"})
            if (const Json::json_pointer at(place);
                grip.is_object() && grip.contains(at) && grip[at].is_boolean() && grip[at].get<bool>())
              return true;
    return false;
  }

  const std::string service_, dialect_;
  std::string wanted_;  // the device's id; empty: the first
  Json id_ = "";        // the same as the service writes it
  asio::io_context io_{1};
  beast::flat_buffer buffer_;
  std::optional<Stream> stream_;  // none: not connected
  std::optional<HandReading> newest_;
  boost::system::error_code read_error_;
  TimePoint tried_{};  // to connect, last
  bool is_there_ = true;
};

}  // namespace

int main(int argc, char** argv) try {
  AdapterLine line = adapter_line(argc, argv, kUsage, {"--service", "--dialect", "--device"});
  const auto own = [&](const char* name, const char* otherwise) {
    return line.own.contains(name) ? line.own[name] : std::string(otherwise);
  };
  const std::string dialect = own("--dialect", "vector");
  if (dialect != "vector" && dialect != "values") throw UserError(kUsage);
  line.mapping.R_WD = device_in_world(Vec3::UnitX(), Vec3::UnitZ());  // x right, y away from the user, z up
  Inverse3 device(own("--service", "127.0.0.1:10001"), dialect, own("--device", ""));
  return run_hand_adapter(device, line);
} catch (const std::exception& e) {
  std::fprintf(stderr, "haply_device: %s\n", e.what());
  return 2;
}
