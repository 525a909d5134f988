// Adapter for Force Dimension's devices (omega, delta, sigma) by their SDK, dhd: built where it is
// found. Written from the SDK's reference, not run on a device.
//
//   force_dimension_device HOST:PORT [--needle N] [--token FILE] [--scale S] [--start X,Y,Z] [--seconds S]
#include <dhdc.h>

#include <cstdio>

#include "apps/examples/hand_adapter.h"
#include "core/base/error.h"

namespace {

using namespace brachy;

constexpr double kMmPerM = 1000;

class ForceDimension final : public HandDevice {
 public:
  ForceDimension() {
    if (dhdOpen() < 0) throw UserError(std::string("no Force Dimension device: ") + dhdErrorGetLastStr());
    dhdEnableForce(DHD_ON);
  }
  ~ForceDimension() override { dhdClose(); }
  ForceDimension(const ForceDimension&) = delete;
  ForceDimension& operator=(const ForceDimension&) = delete;

  HandDeviceFacts facts() const override { return {"force_dimension_device", 12, 0.001, 1000}; }

  bool exchange(const Vec3& force_n, HandReading& reading) override {
    double x = 0, y = 0, z = 0;
    if (dhdGetPosition(&x, &y, &z) < 0) return false;
    reading.p_DN = kMmPerM * Vec3(x, y, z);
    reading.button = dhdGetButton(0) == DHD_ON;
    return dhdSetForce(force_n.x(), force_n.y(), force_n.z()) >= 0;
  }
};

}  // namespace

int main(int argc, char** argv) try {
  AdapterLine line =
      adapter_line(argc, argv,
                   "usage: force_dimension_device HOST:PORT [--needle N] [--token FILE] [--scale S] "
                   "[--start X,Y,Z] [--seconds S]",
                   {});
  // dhd's x points to the user, y to the right, z up. Three axes: the needle points along the world's +z.
  line.mapping.R_WD = device_in_world(Vec3::UnitY(), Vec3::UnitZ());
  ForceDimension device;
  return run_hand_adapter(device, line);
} catch (const std::exception& e) {
  std::fprintf(stderr, "force_dimension_device: %s\n", e.what());
  return 2;
}
