#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "apps/daemon/loops/ultrasound_scanner.h"
#include "core/realtime/hand_over.h"
#include "core/scene/scene.h"
#include "net/wire/messages.h"

namespace brachy {

class SwitchedDevice;

/// The ultrasound scanner's console and the probe's stepper: what operators and the probe's device set (SCANNER in
/// net/PROTOCOL.md), for the ultrasound thread and for the clients. Threads: the io thread.
class ScannerConsole {
 public:
  /// `probe`: its device, with a stepper, where the scene has a probe; else null. Both outlive this. `publish`: sends
  /// to the clients what is in use.
  ScannerConsole(const Scene& scene, SwitchedDevice* probe,
                 std::function<void(const net::ScannerMessage&)> publish);

  HandOver<ScannerSettings>::Reader& reader() { return settings_.reader; }  ///< ultrasound thread

  /// Carries out a request. Returns "" if it is done, else the reason why nothing of it is.
  std::string execute(const net::ScannerMessage& request);
  /// What the clients want now, and the newest tick.
  void update(const net::ImageDemand& demand, std::uint64_t tick);
  /// A device took the probe, or left it.
  void on_probe_device(bool attached);
  /// What is in use.
  net::ScannerMessage message() const;

 private:
  std::string refusal(const net::ScannerMessage& request) const;
  bool moves_probe() const;  ///< the stepper does
  void hand_over();

  SwitchedDevice* probe_;
  const std::function<void(const net::ScannerMessage&)> publish_;
  HandOver<ScannerSettings> settings_;
  ScannerSettings in_use_;
  bool has_device_ = false;
  std::uint64_t tick_ = 0, changed_tick_ = 0;
};

}  // namespace brachy
