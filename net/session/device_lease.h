#pragma once

#include <cstdint>
#include <optional>
#include <string>

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

  /// False where another holds it.
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

  /// "NAME (ADDRESS)", or "" where nobody holds it.
  std::string holder() const {
    if (!holder_) return {};
    return holder_->address.empty() ? holder_->name : holder_->name + " (" + holder_->address + ")";
  }
  std::uint64_t session() const {
    return holder_ ? holder_->session : 0;
  }  ///< 0: the daemon's own, or nobody
  std::int64_t since_ns() const { return holder_ ? holder_->since_ns : 0; }

 private:
  std::optional<Holder> holder_;
};

}  // namespace brachy::net
