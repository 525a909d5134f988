// Compiled instead of nats_link.cpp where libnats is not installed.
#include <stdexcept>

#include "net/broker/nats_link.h"

namespace brachy::net {

struct NatsLink::Handles {};

NatsLink::NatsLink(const BrokerOptions&, const std::string&) {
  throw std::runtime_error("built without NATS");  // check_broker_options has refused it before
}
NatsLink::~NatsLink() = default;
bool NatsLink::is_up() const {
  return false;
}
std::size_t NatsLink::max_payload() const {
  return 0;
}
bool NatsLink::publish(const std::string&, std::span<const std::byte>) {
  return false;
}
std::optional<Bytes> NatsLink::next(std::chrono::milliseconds) {
  return std::nullopt;
}

std::string_view nats_version() {
  return "";
}

}  // namespace brachy::net
