#pragma once

#include <optional>
#include <string>

#include "apps/options.h"
#include "haptics/force/negotiation.h"
#include "haptics/simulated/hand_report.h"
#include "haptics/simulated/simulated_loop.h"
#include "haptics/trajectory/trajectory.h"

namespace brachy {

/// The options in the units of haptics; the force limits as negotiated for the loop that they close.
LoopSettings loop_settings(const SimulatedDeviceOptions& options);

/// A report whose least swing is several of the device's encoder steps.
HandReport hand_report(const SimulatedDeviceOptions& options);

/// A hand moves along `hand` and holds the device, closed to a loop with `simulation` in virtual time for that many of
/// its ticks.
HandReport hold(const SimulatedDeviceOptions& options, const Trajectory& hand, double tick_period_s,
                std::uint64_t ticks, LoopSimulation simulation);

/// The report as the member "hand" of a JSON object on one line, or as a line for people; unchanged and empty without a
/// device.
std::string with_hand(const std::string& json, const std::optional<SimulatedDeviceOptions>& device,
                      const HandReport& report);
std::string to_text(const std::optional<SimulatedDeviceOptions>& device, const HandReport& report);

}  // namespace brachy
