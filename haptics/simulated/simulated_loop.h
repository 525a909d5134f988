#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

#include "core/needle/local_contact_model.h"
#include "core/needle/needle_pose.h"
#include "haptics/force/local_force.h"
#include "haptics/force/received_force.h"
#include "haptics/simulated/delay_line.h"
#include "haptics/simulated/device_dynamics.h"

namespace brachy {

/// Parameters of a closed loop of device, network and simulation.
struct LoopSettings {
  DeviceDynamicsSettings device;
  bool local_model = true;          ///< the device evaluates its force; false: the server does and sends it
  double delay_s = 0;               ///< of the network, each way, ≥ 0
  double drop_share = 0;            ///< of the poses, 0 … 1
  std::uint64_t seed = 1;           ///< of which poses are lost
  double simulation_hz = 200;       ///< > 0
  double wire_hz = 1000;            ///< forces a second from the server, > 0, if it sends them
  double server_ends_s = INFINITY;  ///< from then on the server, stopped or dead, sends nothing
  ForceLimits limits;               ///< applied where the force is evaluated
};

/// One tick of the simulation with the newest pose received (not present: none yet).
using LoopSimulation = std::function<LocalContactModel(const NeedlePose&)>;

/// A device with mass, a network with delay and losses, and a simulation, as a closed loop in virtual time:
/// no clock, no socket, deterministic. The simulation ticks and the server evaluates at multiples of their
/// periods; at the same instant a device cycle comes first. So a force from the wire is one device cycle late
/// even without delay.
/// Threads: one.
class SimulatedLoop {
 public:
  /// The device starts at rest in the hand at `start`.
  SimulatedLoop(const LoopSettings& settings, LoopSimulation simulation, const RigidTransform& start);

  /// One device cycle: read, evaluate or receive the force, send, move. The hand is at `hand` at its end.
  /// Returns the force on the needle during the cycle, N.
  Vec3 step(const RigidTransform& hand);

  /// The force from the wire was past its time to live, and the device latched.
  bool is_latched() const { return received_.is_latched(); }

  const DeviceDynamics& device() const { return device_; }
  DeviceDynamics& device() { return device_; }
  double time_s() const { return 1e-9 * static_cast<double>(now_ns_); }
  /// Longest time from reading a pose to the begin of its force: the loop's delay in negotiation.h.
  double longest_delay_s() const { return 1e-9 * static_cast<double>(longest_delay_ns_); }
  std::uint64_t poses_lost() const { return poses_.lost(); }

 private:
  struct StampedModel {
    LocalContactModel model;
    std::int64_t pose_stamp_ns;  // of the pose that it is of
  };
  struct StampedForce {
    Vec3 force_n;
    std::int64_t pose_stamp_ns;
  };

  void serve_until(std::int64_t now_ns);
  void tick(std::int64_t at_ns);
  void evaluate(std::int64_t at_ns);
  void receive_pose(std::int64_t at_ns);
  Vec3 force_now(const Vec3& tip);

  LoopSettings settings_;
  LoopSimulation simulation_;
  std::int64_t period_ns_, tick_period_ns_, wire_period_ns_;
  std::int64_t now_ns_ = 0, next_tick_ns_ = 0, next_evaluation_ns_ = 0, longest_delay_ns_ = 0;

  DelayLine<NeedlePose> poses_;
  DelayLine<StampedModel> models_;
  DelayLine<StampedForce> forces_;

  DeviceDynamics device_;
  Mat3 R_WN_;  // of the hand
  std::uint64_t sequence_ = 0;
  LocalForce local_;        // beside the device, or in the server
  ReceivedForce received_;  // the device's, from the wire
  NeedlePose pose_;         // the server's newest
};

}  // namespace brachy
