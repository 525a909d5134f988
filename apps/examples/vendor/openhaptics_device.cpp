// Adapter for 3D Systems' Touch and Phantom devices by OpenHaptics: built where its SDK is found.
// Written from the SDK's reference, not run on a device.
//
//   openhaptics_device HOST:PORT [--needle N] [--token FILE] [--scale S] [--start X,Y,Z] [--seconds S]
#include <HD/hd.h>

#include <cstdio>

#include "apps/examples/hand_adapter.h"
#include "core/base/error.h"

namespace {

using namespace brachy;

class OpenHaptics final : public HandDevice {
 public:
  OpenHaptics() : device_(hdInitDevice(HD_DEFAULT_DEVICE)) {
    if (HD_DEVICE_ERROR(hdGetError())) throw UserError("no OpenHaptics device: is its driver running?");
    hdEnable(HD_FORCE_OUTPUT);
    hdStartScheduler();
  }
  ~OpenHaptics() override {
    hdStopScheduler();
    hdDisableDevice(device_);
  }
  OpenHaptics(const OpenHaptics&) = delete;
  OpenHaptics& operator=(const OpenHaptics&) = delete;

  HandDeviceFacts facts() const override { return {"openhaptics_device", 3.3, 0.0005, 1000}; }

  /// The driver's scheduler calls back at 1 kHz and blocks until then.
  bool exchange(const Vec3& force_n, HandReading& reading) override {
    Frame frame{force_n, &reading};
    hdScheduleSynchronous(&OpenHaptics::on_frame, &frame, HD_DEFAULT_SCHEDULER_PRIORITY);
    return !HD_DEVICE_ERROR(hdGetError());
  }

 private:
  struct Frame {
    Vec3 force_n;
    HandReading* reading;
  };
  static HDCallbackCode HDCALLBACK on_frame(void* user) {
    const auto& frame = *static_cast<Frame*>(user);
    HDdouble matrix[16];  // column by column, mm
    HDint buttons = 0;
    hdBeginFrame(hdGetCurrentDevice());
    hdGetDoublev(HD_CURRENT_TRANSFORM, matrix);
    hdGetIntegerv(HD_CURRENT_BUTTONS, &buttons);
    hdSetDoublev(HD_CURRENT_FORCE, frame.force_n.data());
    hdEndFrame(hdGetCurrentDevice());
    Mat3& R_DN = frame.reading->R_DN.emplace();
    for (int column = 0; column < 3; ++column)
      for (int row = 0; row < 3; ++row) R_DN(row, column) = matrix[4 * column + row];
    // The stylus points along its −z, the needle along +z.
    R_DN.col(0) *= -1;
    R_DN.col(2) *= -1;
    frame.reading->p_DN = Vec3(matrix[12], matrix[13], matrix[14]);
    frame.reading->button = (buttons & HD_DEVICE_BUTTON_1) != 0;
    return HD_CALLBACK_DONE;
  }

  HHD device_;
};

}  // namespace

int main(int argc, char** argv) try {
  AdapterLine line =
      adapter_line(argc, argv,
                   "usage: openhaptics_device HOST:PORT [--needle N] [--token FILE] [--scale S] "
                   "[--start X,Y,Z] [--seconds S]",
                   {});
  // The device's x is right, y up, z to the user.
  line.mapping.R_WD = device_in_world(Vec3::UnitX(), Vec3::UnitY());
  OpenHaptics device;
  return run_hand_adapter(device, line);
} catch (const std::exception& e) {
  std::fprintf(stderr, "openhaptics_device: %s\n", e.what());
  return 2;
}
