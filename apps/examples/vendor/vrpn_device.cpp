// Adapter for trackers that a VRPN server serves: built where VRPN is found. Written from VRPN's
// headers, not run with a tracker. It renders no force.
//
//   vrpn_device HOST:PORT --tracker Tracker0@localhost [--needle N] [--token FILE] …
#include <vrpn_Button.h>
#include <vrpn_Tracker.h>

#include <cstdio>

#include "apps/examples/hand_adapter.h"
#include "core/base/error.h"

namespace {

using namespace brachy;

constexpr const char* kUsage =
    "usage: vrpn_device HOST:PORT --tracker NAME@HOST [--needle N] [--token FILE] [--scale S] [--start "
    "X,Y,Z] "
    "[--seconds S]";
constexpr double kMmPerM = 1000;

class VrpnTracker final : public HandDevice {
 public:
  explicit VrpnTracker(const std::string& name) : tracker_(name.c_str()), buttons_(name.c_str()) {
    tracker_.register_change_handler(this, &VrpnTracker::on_pose);
    buttons_.register_change_handler(this, &VrpnTracker::on_button);
  }

  HandDeviceFacts facts() const override { return {"vrpn_device", 0, 0, 200}; }

  bool exchange(const Vec3&, HandReading& reading) override {
    tracker_.mainloop();
    buttons_.mainloop();
    reading = last_;
    return tracker_.connectionPtr()->doing_okay() != 0;
  }

 private:
  static void VRPN_CALLBACK on_pose(void* user, const vrpn_TRACKERCB report) {
    auto& self = *static_cast<VrpnTracker*>(user);
    self.last_.p_DN = kMmPerM * Vec3(report.pos[0], report.pos[1], report.pos[2]);
    const Eigen::Quaterniond q(report.quat[3], report.quat[0], report.quat[1], report.quat[2]);
    self.last_.R_DN = q.normalized().toRotationMatrix();
  }
  static void VRPN_CALLBACK on_button(void* user, const vrpn_BUTTONCB report) {
    if (report.button == 0) static_cast<VrpnTracker*>(user)->last_.button = report.state != 0;
  }

  vrpn_Tracker_Remote tracker_;
  vrpn_Button_Remote buttons_;
  HandReading last_;
};

}  // namespace

int main(int argc, char** argv) try {
  AdapterLine line = adapter_line(argc, argv, kUsage, {"--tracker"});
  if (!line.own.contains("--tracker")) throw UserError(kUsage);
  VrpnTracker device(line.own["--tracker"]);
  return run_hand_adapter(device, line);
} catch (const std::exception& e) {
  std::fprintf(stderr, "vrpn_device: %s\n", e.what());
  return 2;
}
