// A user's adapter: a device that stands still, by the installed seam and libraries.
#include <cstdio>

#include "apps/examples/hand_adapter.h"
#include "core/base/error.h"

namespace {

struct StandsStill final : brachy::HandDevice {
  brachy::HandDeviceFacts facts() const override { return {"adapter", 3.3}; }
  bool exchange(const brachy::Vec3& force_n, brachy::HandReading& reading) override {
    reading.p_DN = brachy::Vec3(1, 2, 3);
    return force_n.allFinite();
  }
};

}  // namespace

int main(int argc, char** argv) try {
  StandsStill device;
  return brachy::run_hand_adapter(device, brachy::adapter_line(argc, argv, "usage: adapter HOST:PORT", {}));
} catch (const brachy::UserError& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 2;
}
