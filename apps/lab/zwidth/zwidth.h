#pragma once

#include <string>
#include <vector>

#include "haptics/force/negotiation.h"
#include "haptics/simulated/device_dynamics.h"

namespace brachy {

/// One loop whose largest stable stiffness is determined.
struct ZWidthCase {
  /// the device works out its force; false: forces come over the wire, 1000 a second at most
  bool local_model = true;
  double rate_hz = 1000;     ///< of the device's cycle
  double added_delay_s = 0;  ///< of the network, there and back together
};

struct ZWidthPoint {
  ZWidthCase loop;
  ClosedLoop closed;               ///< T and τ of the loop that is closed; τ as measured in it
  double limit_n_per_mm = 0;       ///< what is negotiated: 2b/(T + 2τ)
  double exact_n_per_mm = 0;       ///< where this mass becomes unstable by the loop's equation (zwidth.cpp)
  double stable_n_per_mm = 0;      ///< largest that did not ring, by bisection
  double greatest_calm_share = 0;  ///< of the limit: largest of kSharesUnder up to which every one was calm
  /// of the limit: least of kSharesOver from which on every one rang; 0: none
  double least_ringing_share = 0;
};

/// Shares of the limit that are tried in addition to the bisection.
inline constexpr double kSharesUnder[] = {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 1};
inline constexpr double kSharesOver[] = {1.1, 1.2, 1.3, 1.5, 2, 3};

/// The free mass of the measurements: `device` without hand and without encoder steps.
DeviceDynamicsSettings free_mass(DeviceDynamicsSettings device);

/// Whether a free mass on a spring that pushes and pulls rings: released 1 µm off equilibrium, its peak-to-peak over
/// the last of eight seconds is greater than over the second before it, or it has grown a hundredfold. The spring is
/// tissue that never slips, through SimulatedLoop, LocalForce and its limit of 0.5 N/ms.
bool rings(const ZWidthCase& loop, const DeviceDynamicsSettings& device, double stiffness_n_per_mm);

/// The point of one case; `device` gives mass and damping.
ZWidthPoint measure_zwidth(const ZWidthCase& loop, const DeviceDynamicsSettings& device);

/// Rates × delays for both ways to close the loop.
std::vector<ZWidthCase> zwidth_cases(bool quick);

std::string to_json(const std::vector<ZWidthPoint>& points, const DeviceDynamicsSettings& device);
/// A Markdown table.
std::string to_markdown(const std::vector<ZWidthPoint>& points);

}  // namespace brachy
