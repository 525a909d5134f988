#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "haptics/force/negotiation.h"
#include "haptics/simulated/hand_report.h"
#include "haptics/simulated/simulated_loop.h"
#include "haptics/trajectory/trajectory.h"

namespace brachy {

/// The device with mass between the trajectory, which is the hand's, and the needle (--device-dynamics).
struct SimulatedDeviceOptions {
  double mass_kg = 0.1;
  double damping_n_s_per_m = 0.5;                                   ///< of the device
  double hand_stiffness_n_per_m = 300, hand_damping_n_s_per_m = 5;  ///< of the grip
  double rate_hz = 1000;
  double encoder_um = 20;
  double max_force_n = 3.3;
  double delay_ms = 0;    ///< added each way
  double drop_share = 0;  ///< of the poses
  std::uint64_t seed = 1;
  bool simple_client = false;  ///< forces come over the wire instead of the local model
};

/// The options in the units of haptics; the force limits as negotiated for the loop that they close.
LoopSettings loop_settings(const SimulatedDeviceOptions& options);

/// A report whose least swing is several of the device's encoder steps.
HandReport hand_report(const SimulatedDeviceOptions& options);

/// A hand moves along `hand` and holds the device, closed to a loop with `simulation` in virtual time for that many of
/// its ticks.
HandReport hold(const SimulatedDeviceOptions& options, const Trajectory& hand, double tick_period_s,
                std::uint64_t ticks, LoopSimulation simulation);

/// The report as the member "hand" of a JSON object on one line, or as a line of text; unchanged and empty without a
/// device.
std::string with_hand(const std::string& json, const std::optional<SimulatedDeviceOptions>& device,
                      const HandReport& report);
std::string to_text(const std::optional<SimulatedDeviceOptions>& device, const HandReport& report);

}  // namespace brachy
