#include "net/access/gate.h"

#include <utility>

#include "net/base/clock.h"

namespace brachy::net {
namespace {

constexpr std::size_t kMaxAddresses = 1024;  // for which wrong tokens are counted

ErrorMessage fatal(ErrorCode code, std::string text) {
  return {code, true, 0, 0, std::move(text)};
}

}  // namespace

ConnectionSlot::ConnectionSlot(std::shared_ptr<ConnectionCounts> counts, std::string address,
                               std::optional<ErrorMessage> refusal)
    : counts_(std::move(counts)), address_(std::move(address)), refusal_(std::move(refusal)) {
  if (!counts_) return;
  if (refusal_) {
    ++counts_->pending_refusals;
    return;
  }
  ++counts_->slots;
  ++counts_->slots_of[address_];
}

ConnectionSlot::~ConnectionSlot() {
  if (!counts_) return;
  if (refusal_) {
    --counts_->pending_refusals;
    return;
  }
  --counts_->slots;
  const auto of_address = counts_->slots_of.find(address_);
  if (--of_address->second == 0) counts_->slots_of.erase(of_address);
}

Gate::Gate(std::uint32_t max_slots, std::uint32_t max_of_address, TokenGrants tokens)
    : max_slots_(max_slots), max_of_address_(max_of_address), tokens_(std::move(tokens)) {}

std::shared_ptr<const ConnectionSlot> Gate::acquire_slot(const std::string& address, std::int64_t now_ns) {
  auto refused = refusal_at_entry(address, now_ns);
  refused_ += refused ? 1 : 0;
  if (refused && counts_->pending_refusals >= kMaxPendingRefusals) return nullptr;
  return std::make_shared<const ConnectionSlot>(counts_, address, std::move(refused));
}

std::shared_ptr<const ConnectionSlot> Gate::exempt_slot() {
  return std::make_shared<const ConnectionSlot>(nullptr, "", std::nullopt);
}

std::optional<ErrorMessage> Gate::refusal_at_entry(const std::string& address, std::int64_t now_ns) {
  if (is_blocked(address, now_ns))
    return fatal(ErrorCode::kUnauthorised,
                 "too many wrong tokens were sent from " + address + ": try again in a minute");
  if (counts_->slots >= max_slots_)
    return fatal(ErrorCode::kBusy, "all " + std::to_string(max_slots_) + " client slots are in use");
  const auto of_address = counts_->slots_of.find(address);
  if (of_address != counts_->slots_of.end() && of_address->second >= max_of_address_)
    return fatal(ErrorCode::kBusy, "all " + std::to_string(max_of_address_) +
                                       " client slots of one address are in use by " + address);
  return std::nullopt;
}

std::optional<ErrorMessage> Gate::refusal(const std::string& address, const std::optional<Token>& shown,
                                          Role role, std::int64_t now_ns) {
  if (tokens_.is_empty()) return std::nullopt;
  if (!shown)
    return fatal(
        ErrorCode::kUnauthorised,
        "this daemon requires a token: give --token-file FILE, in a browser append #token=… to the address");
  switch (tokens_.ask(*shown, role)) {
    case TokenGrants::Answer::kGranted:
      return std::nullopt;
    case TokenGrants::Answer::kOtherRole:
      return fatal(ErrorCode::kUnauthorised, "the token is not for this role");
    case TokenGrants::Answer::kUnknown:
      break;
  }
  record_wrong_token(address, now_ns);
  return fatal(ErrorCode::kUnauthorised, "the token is not known to this daemon");
}

void Gate::record_wrong_token(const std::string& address, std::int64_t now_ns) {
  ++wrong_tokens_;
  const auto is_over = [&](const auto& entry) {
    return now_ns - entry.second.back() >= in_ns(kWrongTokensWindow);
  };
  if (wrong_token_times_.size() >= kMaxAddresses) std::erase_if(wrong_token_times_, is_over);
  if (wrong_token_times_.size() >= kMaxAddresses) wrong_token_times_.erase(wrong_token_times_.begin());
  std::vector<std::int64_t>& times = wrong_token_times_[address];
  if (times.size() == kMaxWrongTokens) times.erase(times.begin());
  times.push_back(now_ns);
}

bool Gate::is_blocked(const std::string& address, std::int64_t now_ns) const {
  const auto wrong = wrong_token_times_.find(address);
  return wrong != wrong_token_times_.end() && wrong->second.size() == kMaxWrongTokens &&
         now_ns - wrong->second.front() < in_ns(kWrongTokensWindow);
}

}  // namespace brachy::net
