#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/daemon/forces/tick_forces.h"
#include "haptics/force/force_gate.h"
#include "haptics/force/local_force.h"
#include "haptics/force/model_limits.h"
#include "net/session/server_options.h"

namespace brachy {

/// The receivers of a ForceLink's messages: a net::Server, or a test.
struct ForceLinkOutputs {
  std::function<void(const net::ForceMessage&)> send_force;  ///< to the needle's device
  std::function<void(const net::LocalModelMessage&)> send_model;
  std::function<std::optional<double>(std::uint16_t needle)> round_trip_s;  ///< as Server::round_trip_s
  std::function<void(const net::EventMessage&)> announce;
};

/// A line for the log: what a device's force and stiffness are limited to.
std::string negotiated_line(const net::DeviceInfo& device, const net::NegotiatedLimits& limits);

/// From the simulation's forces to the hands: negotiates with each device what its loop renders stably, sends
/// LOCAL_MODEL to those that evaluate their force themselves and FORCE to all, puts a ForceGate before every
/// hand, and announces and counts its interventions. A device that receives forces over the wire gets them at
/// the lesser of its rate and 1 kHz, evaluated here from the newest model and the newest pose; consecutive
/// FORCEs differ by at most 0.5 N. A device with the local model gets both messages each tick, the model
/// already scaled by the gate's gain: the ramp is applied here, the slew limit by the device.
///
/// It reads no clock and opens no socket: times are the caller's, all of one monotonic clock, that of
/// NeedlePose::received_ns. Threads: one, the io thread.
class ForceLink {
 public:
  /// The round trip assumed for a device that has answered no PING yet, s.
  static constexpr double kUnknownRoundTrip = 0.05;
  static constexpr double kDefaultRateHz = 1000;  ///< of a device that states none

  ForceLink(std::size_t needles, ForceLinkOutputs outputs);

  void attach(const net::DeviceInfo& device);
  /// A fault if the needle is in contact.
  void detach(const net::DeviceInfo& device);
  /// `client` re-enables the force after a fault; does nothing without one.
  void arm(std::uint16_t needle, const std::string& client);

  /// With the needle's device, as of now; before attach() with one that states nothing.
  net::NegotiatedLimits negotiated(std::uint16_t needle) const;

  void pose_accepted(std::uint16_t needle, const NeedlePose& pose);
  void pose_not_finite(std::uint16_t needle);

  /// A tick was published. The same tick again changes nothing.
  void on_tick(const TickForces& tick, std::int64_t now_ns);
  /// Checks for faults, evaluates and sends the forces that are due. To be called every period_ns() while
  /// is_active().
  void cycle(std::int64_t now_ns);

  /// A device is attached, or a force still decays to 0.
  bool is_active() const;
  std::int64_t period_ns() const;  ///< of the fastest hand, ≥ 1 ms

  const ForceGate& gate(std::uint16_t needle) const { return hands_[needle].gate; }
  /// Over all needles since start, indexed by Intervention.
  std::array<std::uint64_t, kInterventions> interventions() const;
  void add_to(net::StateMessage& state) const;

 private:
  struct Hand {
    std::uint16_t needle = 0;
    net::DeviceInfo device;
    ForceGate gate;
    LocalForce local;
    StiffnessLimiter stiffness;
    ForceLimits limits;  // as negotiated at the last tick
    bool is_stiffness_limited = false;
    NeedleTick tick;            // the newest
    bool has_new_tick = false;  // since the last FORCE
    std::optional<NeedlePose> pose;
    std::int64_t first_pose_ns = 0;  // arrival, since attach
    Vec3 force_n = Vec3::Zero();     // last force sent to the hand
    std::int64_t next_ns = 0;        // when its next force is due

    bool is_active() const { return gate.connected() || !force_n.isZero(0); }
    double rate_hz() const;
    std::int64_t period_ns() const;
  };

  ForceLimits negotiate_with(const Hand& hand) const;
  void update_model(Hand& hand, std::int64_t now_ns);
  void send_force(Hand& hand, std::int64_t now_ns);
  void announce_interventions(Hand& hand);
  void announce(const Hand& hand, const std::string& what) const;

  ForceLinkOutputs outputs_;
  std::vector<Hand> hands_;  // by needle
  std::uint64_t tick_ = 0;
};

}  // namespace brachy
