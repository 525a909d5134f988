#include "net/access/gate.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace brachy::net {
namespace {

ErrorMessage fatal(ErrorCode code, std::string text) {
  return {code, true, 0, 0, std::move(text)};
}

constexpr const char* kLoopback = "the loopback";

}  // namespace

std::string origin_of(const std::string& address) {
  in_addr v4{};
  if (::inet_pton(AF_INET, address.c_str(), &v4) == 1)
    return (ntohl(v4.s_addr) >> 24) == 127 ? kLoopback : address;
  in6_addr v6{};
  const std::string without_zone = address.substr(0, address.find('%'));
  if (::inet_pton(AF_INET6, without_zone.c_str(), &v6) != 1) return address;
  if (IN6_IS_ADDR_LOOPBACK(&v6)) return kLoopback;
  std::memset(v6.s6_addr + 8, 0, 8);
  char text[INET6_ADDRSTRLEN] = "";
  ::inet_ntop(AF_INET6, &v6, text, sizeof text);
  return std::string(text) + "/64";
}

ConnectionSlot::ConnectionSlot(std::shared_ptr<ConnectionCounts> counts, std::string address, Stage stage,
                               std::optional<ErrorMessage> refusal)
    : counts_(std::move(counts)),
      address_(std::move(address)),
      origin_(origin_of(address_)),
      stage_(stage),
      refusal_(std::move(refusal)) {
  enter(stage);
}

ConnectionSlot::~ConnectionSlot() {
  leave();
}

void ConnectionSlot::enter(Stage stage) {
  stage_ = stage;
  switch (stage) {
    case Stage::kExempt:
    case Stage::kShed:
      return;
    case Stage::kWaiting:
      counts_->waiting.push_back(this);
      return;
    case Stage::kRefused:
      ++counts_->pending_refusals;
      return;
    case Stage::kImmediateClient:
      ++counts_->immediate;
      [[fallthrough]];
    case Stage::kClient:
      ++counts_->clients;
      ++counts_->clients_of[origin_];
  }
}

void ConnectionSlot::leave() {
  switch (stage_) {
    case Stage::kExempt:
    case Stage::kShed:
      return;
    case Stage::kWaiting:
      std::erase(counts_->waiting, this);
      return;
    case Stage::kRefused:
      --counts_->pending_refusals;
      return;
    case Stage::kImmediateClient:
      --counts_->immediate;
      [[fallthrough]];
    case Stage::kClient: {
      --counts_->clients;
      const auto of_origin = counts_->clients_of.find(origin_);
      if (--of_origin->second == 0) counts_->clients_of.erase(of_origin);
    }
  }
}

Gate::Gate(std::uint32_t max_clients, std::uint32_t max_of_origin, TokenGrants tokens)
    : max_clients_(max_clients), max_of_origin_(max_of_origin), tokens_(std::move(tokens)) {}

std::shared_ptr<ConnectionSlot> Gate::acquire_slot(const std::string& address, Entry entry) {
  using Stage = ConnectionSlot::Stage;
  const auto slot = [&](Stage stage, std::optional<ErrorMessage> refusal = {}) {
    return std::make_shared<ConnectionSlot>(counts_, address, stage, std::move(refusal));
  };
  auto refusal = no_slot_for(origin_of(address));
  if (!refusal && entry == Entry::kImmediate && counts_->immediate >= std::max(1u, max_clients_ / 4))
    refusal = fatal(ErrorCode::kBusy, "all slots of clients that need no HELLO are in use");
  refused_ += refusal ? 1 : 0;
  if (refusal && entry != Entry::kRequest) {
    if (counts_->pending_refusals >= kMaxPendingRefusals) return nullptr;
    return slot(Stage::kRefused, std::move(refusal));
  }
  if (entry == Entry::kImmediate) return slot(Stage::kImmediateClient);
  shed_oldest();
  return slot(Stage::kWaiting);
}

/// A rightful client says HELLO at once and is not the oldest for long; and of two origins the one with fewer
/// connections keeps them.
void Gate::shed_oldest() {
  while (counts_->waiting.size() >= kMaxWaiting) {
    std::map<std::string, std::size_t> of;
    for (const ConnectionSlot* slot : counts_->waiting) ++of[slot->origin()];
    const std::size_t most = std::max_element(of.begin(), of.end(), [](const auto& a, const auto& b) {
                               return a.second < b.second;
                             })->second;
    const auto oldest = std::find_if(counts_->waiting.begin(), counts_->waiting.end(),
                                     [&](const ConnectionSlot* slot) { return of[slot->origin()] == most; });
    ConnectionSlot* const slot = *oldest;
    counts_->waiting.erase(oldest);
    slot->stage_ = ConnectionSlot::Stage::kShed;
    ++shed_;
    if (const auto close = std::exchange(slot->close_, nullptr)) close();  // the slot may be gone afterwards
  }
}

std::shared_ptr<ConnectionSlot> Gate::exempt_slot() {
  return std::make_shared<ConnectionSlot>(nullptr, "", ConnectionSlot::Stage::kExempt, std::nullopt);
}

std::optional<ErrorMessage> Gate::busy(const ConnectionSlot& slot) const {
  return slot.is_waiting() ? no_slot_for(slot.origin()) : std::nullopt;
}

void Gate::promote(ConnectionSlot& slot) {
  if (!slot.is_waiting()) return;
  slot.leave();
  slot.enter(ConnectionSlot::Stage::kClient);
}

std::optional<ErrorMessage> Gate::no_slot_for(const std::string& origin) const {
  if (counts_->clients >= max_clients_)
    return fatal(ErrorCode::kBusy, "all " + std::to_string(max_clients_) + " client slots are in use");
  const auto of_origin = counts_->clients_of.find(origin);
  if (of_origin != counts_->clients_of.end() && of_origin->second >= max_of_origin_)
    return fatal(ErrorCode::kBusy, "all " + std::to_string(max_of_origin_) +
                                       " client slots of one address are in use by " + origin);
  return std::nullopt;
}

std::optional<ErrorMessage> Gate::refusal(const std::optional<Token>& shown, Role role) {
  if (tokens_.is_empty()) return std::nullopt;
  if (!shown)
    return fatal(
        ErrorCode::kUnauthorised,
        "this daemon requires a token: give --token-file FILE, in a browser append #token=… to the address, "
        "over HTTP send Authorization: Bearer and the output of `brachy token --show`");
  switch (tokens_.ask(*shown, role)) {
    case TokenGrants::Answer::kGranted:
      return std::nullopt;
    case TokenGrants::Answer::kOtherRole:
      return fatal(ErrorCode::kUnauthorised, "the token is not for this role");
    case TokenGrants::Answer::kUnknown:
      break;
  }
  ++wrong_tokens_;
  return fatal(ErrorCode::kUnauthorised, "the token is not known to this daemon");
}

}  // namespace brachy::net
