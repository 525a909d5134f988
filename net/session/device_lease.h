#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "net/wire/messages.h"

namespace brachy::net {

/// One device at a time may send the poses of a needle. The daemon's own scripted device holds the lease as session 0.
class DeviceLease {
 public:
  struct Holder {
    std::uint64_t session = 0;
    std::string name;
    std::string address;  ///< empty for the daemon's own device
    std::int64_t since_ns = 0;
  };

  /// False where another device holds it.
  bool take(const Holder& holder) {
    if (holder_) return false;
    holder_ = holder;
    return true;
  }
  /// Does nothing where `session` does not hold it.
  void release(std::uint64_t session) {
    if (is_held_by(session)) holder_.reset();
  }
  bool is_held() const { return holder_.has_value(); }
  bool is_held_by(std::uint64_t session) const { return holder_ && holder_->session == session; }

  /// "NAME (ADDRESS)", or "" where it is free.
  std::string holder() const {
    if (!holder_) return {};
    return holder_->address.empty() ? holder_->name : holder_->name + " (" + holder_->address + ")";
  }
  std::uint64_t session() const { return holder_ ? holder_->session : 0; }  ///< 0: the daemon's own, or free
  std::int64_t since_ns() const { return holder_ ? holder_->since_ns : 0; }

 private:
  std::optional<Holder> holder_;
};

/// The leases of a scene's needles, by id.
class DeviceLeases {
 public:
  /// `probe`: the one of them that is lent only to a device that asks for it by its number; kAnyNeedle: none is.
  explicit DeviceLeases(std::uint16_t needles, std::uint16_t probe = kAnyNeedle)
      : leases_(needles), probe_(probe) {}

  std::size_t size() const { return leases_.size(); }
  DeviceLease& operator[](std::size_t needle) { return leases_.at(needle); }
  const DeviceLease& operator[](std::size_t needle) const { return leases_.at(needle); }

  /// Leases `holder` the needle it asks for (kAnyNeedle: the first needle that is free) and writes it to `granted`, or
  /// returns the reason why not.
  std::optional<ErrorMessage> lend(const DeviceLease::Holder& holder, std::uint16_t wanted,
                                   std::uint16_t& granted);

  /// "NAME (ADDRESS)"; of several needles "0: NAME (ADDRESS), 2: …". Empty: all are free.
  std::string holders() const;
  /// " (needle N)", or "" where there is only one.
  std::string of_needle(std::size_t needle) const;

 private:
  std::vector<DeviceLease> leases_;
  std::uint16_t probe_;
};

}  // namespace brachy::net
