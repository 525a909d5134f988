// Adapter for a gamepad or joystick, by evdev: the left stick moves the needle across, the right one in and out, the
// first button drops seeds. It renders no force.
//
//   gamepad_device HOST:PORT --input /dev/input/by-id/usb-…-event-joystick [--needle N] [--token FILE] …
//
// Reading it needs membership of the group `input`. A regular file of struct input_event is played instead, a
// report per cycle: for tests.
#include <fcntl.h>
#include <linux/input.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdio>
#include <map>

#include "apps/examples/hand_adapter.h"
#include "core/base/error.h"

namespace {

using namespace brachy;

constexpr const char* kUsage =
    "usage: gamepad_device HOST:PORT --input /dev/input/eventN [--needle N] [--token FILE] [--scale S] "
    "[--start X,Y,Z] "
    "[--seconds S]";
constexpr double kRateHz = 200, kSpeedMmPerS = 30;
constexpr double kDeadZone = 0.12;  // of sticks that do not come back to their middle

class Gamepad final : public HandDevice {
 public:
  explicit Gamepad(const std::string& path) : file_(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
    struct stat status {};
    if (file_ < 0 || fstat(file_, &status) != 0)
      throw UserError(path + ": cannot be read; is it plugged in, are you in the group `input`?");
    is_played_ = S_ISREG(status.st_mode);
    for (const unsigned axis : {ABS_X, ABS_Y, ABS_RY}) {
      input_absinfo range{};
      const bool is_known = ioctl(file_, EVIOCGABS(axis), &range) == 0 && range.maximum > range.minimum;
      ranges_[axis] =
          is_known ? std::pair<double, double>(range.minimum, range.maximum) : std::pair(-32768.0, 32767.0);
    }
  }
  ~Gamepad() override { close(file_); }
  Gamepad(const Gamepad&) = delete;
  Gamepad& operator=(const Gamepad&) = delete;

  HandDeviceFacts facts() const override { return {"gamepad_device", 0, 0, kRateHz}; }

  bool exchange(const Vec3&, HandReading& reading) override {
    if (!update()) return false;
    // Up on a stick is negative: pushed away from the user, the right one pushes the needle in.
    p_DN_ += Vec3(deflection(ABS_X), deflection(ABS_Y), -deflection(ABS_RY)) * kSpeedMmPerS / kRateHz;
    reading = {p_DN_, std::nullopt, is_down_};
    return true;
  }

 private:
  bool update() {
    input_event event{};
    for (;;) {
      const ssize_t got = ::read(file_, &event, sizeof event);
      if (got < 0) return errno == EAGAIN || errno == EINTR;
      if (got != sizeof event) return false;
      if (event.type == EV_ABS && ranges_.contains(event.code)) at_[event.code] = event.value;
      if (event.type == EV_KEY && event.code == BTN_SOUTH) is_down_ = event.value != 0;
      if (is_played_ && event.type == EV_SYN) return true;
    }
  }
  /// −1 … 1.
  double deflection(unsigned axis) const {
    const auto at = at_.find(axis);
    if (at == at_.end()) return 0;
    const auto [low, high] = ranges_.at(axis);
    const double x = 2 * (at->second - low) / (high - low) - 1;
    return std::abs(x) < kDeadZone ? 0 : x;
  }

  int file_;
  bool is_played_ = false, is_down_ = false;
  std::map<unsigned, std::pair<double, double>> ranges_;
  std::map<unsigned, double> at_;
  Vec3 p_DN_ = Vec3::Zero();  // right, down, in
};

}  // namespace

int main(int argc, char** argv) try {
  AdapterLine line = adapter_line(argc, argv, kUsage, {"--input"});
  if (!line.own.contains("--input")) throw UserError(kUsage);
  line.mapping.R_WD = device_in_world(Vec3::UnitX(), -Vec3::UnitY());
  Gamepad device(line.own["--input"]);
  return run_hand_adapter(device, line);
} catch (const std::exception& e) {
  std::fprintf(stderr, "gamepad_device: %s\n", e.what());
  return 2;
}
