// Example of an adapter for a real device: a six-degree input device (a SpaceNavigator or similar, by evdev) moves
// the needle, and its buttons drop seeds. Its steps: open the device, connect with role device, send poses stamped with
// the local clock.
//
//   spacenav_device HOST:PORT /dev/input/by-id/usb-3Dconnexion_SpaceNavigator-event-mouse [TOKEN_FILE]
//
// Reading it needs membership of the group `input`. A regular file of struct input_event is played instead, a report
// per cycle, then the program ends: for tests, and to replay the output of `cat /dev/input/…`. This device renders no
// force: FORCE and LOCAL_MODEL are ignored. One that does sets evaluates_local_model, hands on_local_model to
// LocalForce::take and calls LocalForce::evaluate in its own cycle (haptics/force/local_force.h); or, simpler, hands
// on_force to ReceivedForce::take and renders ReceivedForce::evaluate (haptics/force/received_force.h). Both end a
// force within its time to live when the daemon stops: no driver renders what it received without one of them.

#include <fcntl.h>
#include <linux/input.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cerrno>
#include <chrono>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "core/realtime/deadline.h"
#include "net/access/token_file.h"
#include "net/client/client.h"

namespace {

using namespace brachy;

constexpr double kFullDeflection = 350;  // counts
constexpr double kSpeedMmPerS = 30, kTurnRadPerS = 0.5;
constexpr auto kCycle = std::chrono::milliseconds(5);

/// Deflections of the six axes, −1 … 1: the device's x, y, z, then turns about them.
class SixAxes {
 public:
  explicit SixAxes(const char* path) : file_(open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    struct stat status {};
    if (file_ < 0 || fstat(file_, &status) != 0)
      throw UserError(std::string(path) +
                      ": cannot be read; is it plugged in, are you in the group `input`?");
    is_played_ = S_ISREG(status.st_mode);
  }

  /// Reads pending reports; false: the device is gone, or the file is at its end.
  bool update() {
    input_event event{};
    for (;;) {
      const ssize_t got = read(file_, &event, sizeof event);
      if (got < 0) return errno == EAGAIN || errno == EINTR;
      if (got != sizeof event) return false;
      const bool axis = (event.type == EV_REL || event.type == EV_ABS) && event.code < at.size();
      if (axis) at[event.code] = event.value / kFullDeflection;
      if (event.type == EV_KEY && (event.value != 0) != is_down_) buttons.push_back(is_down_ = !is_down_);
      if (is_played_ && event.type == EV_SYN) return true;
    }
  }

  std::array<double, 6> at{};
  std::vector<bool> buttons;  ///< that went down or up since this was last cleared

 private:
  int file_;  // until the program ends
  bool is_played_ = false, is_down_ = false;
};

/// The cap's deflection is a speed. The device's frame is x right, y towards the user, z down: z pushes the needle in,
/// y lowers it on the screen. There the needle's +x, the patient's right, is on the left: the cap's axes are the
/// needle's, turned by half a turn about z.
RigidTransform moved(const RigidTransform& X_WN, const SixAxes& axes, double dt_s) {
  const Vec3 push(-axes.at[0], -axes.at[1], axes.at[2]), turn(-axes.at[3], -axes.at[4], axes.at[5]);
  const double angle = turn.norm() * kTurnRadPerS * dt_s;
  RigidTransform X_NM;  // the needle's step, in its own frame
  X_NM.p = push * kSpeedMmPerS * dt_s;
  if (angle > 0) X_NM.R = Eigen::AngleAxisd(angle, turn.normalized()).toRotationMatrix();
  RigidTransform X_WM = X_WN * X_NM;
  X_WM.R = Eigen::Quaterniond(X_WM.R).normalized().toRotationMatrix();  // rounding does not add up
  return X_WM;
}

class Adapter {
 public:
  Adapter(const char* device, std::optional<net::Token> token)
      : axes_(device), timer_(io_), client_(io_, options(token), handlers()) {
    X_WN_.p = Vec3(0, 0, -60);  // in front of the default phantom, which lies about the origin
  }

  void run(const std::string& host, std::uint16_t port) {
    client_.connect(host, port);
    io_.run();
    std::cout << client_.poses_sent() << " poses sent, tip at " << X_WN_.p.transpose() << " mm\n";
  }

 private:
  static net::ClientOptions options(const std::optional<net::Token>& token) {
    net::ClientOptions o;
    o.token = token;
    o.role = net::Role::kDevice;
    o.subscription = net::kSubscribeNoMesh;
    o.name = "spacenav_device";
    o.limits.rate_hz = 1e3 / static_cast<double>(kCycle.count());
    return o;
  }

  net::ClientHandlers handlers() {
    net::ClientHandlers h;
    h.on_welcome = [this](const net::WelcomeMessage&) { timer_.expires_after(kCycle), wait(); };
    h.on_error = [](const net::ErrorMessage& error) { std::cerr << error.text << "\n"; };
    h.on_closed = [](const std::string& reason) { throw std::runtime_error(reason); };
    return h;
  }

  void wait() {
    timer_.async_wait([this](const auto&) { is_over_ ? io_.stop() : cycle(); });
  }

  void cycle() {
    is_over_ = !axes_.update();
    if (!is_over_) {
      X_WN_ = moved(X_WN_, axes_, 1e-3 * static_cast<double>(kCycle.count()));
      client_.send_pose(X_WN_, monotonic_ns());
      for (const bool is_down : axes_.buttons) client_.press(is_down);  // drops a seed
      axes_.buttons.clear();
    }
    // Sends what is queued before the connection closes, which must be before the daemon misses poses (50 ms).
    timer_.expires_at(timer_.expiry() + (is_over_ ? 6 * kCycle : kCycle));
    wait();
  }

  SixAxes axes_;
  RigidTransform X_WN_;
  bool is_over_ = false;
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_;
  net::Client client_;
};

}  // namespace

int main(int argc, char** argv) try {
  const std::string server = argc == 3 || argc == 4 ? argv[1] : "";
  const std::size_t colon = server.rfind(':');
  if (colon == std::string::npos)
    throw UserError("usage: spacenav_device HOST:PORT /dev/input/eventN [TOKEN_FILE]");
  const auto token = argc == 4 ? std::optional(net::load_token(argv[3])) : std::nullopt;
  Adapter(argv[2], token)
      .run(server.substr(0, colon), static_cast<std::uint16_t>(std::stoi(server.substr(colon + 1))));
} catch (const std::exception& e) {
  std::cerr << "spacenav_device: " << e.what() << "\n";
  return 2;
}
