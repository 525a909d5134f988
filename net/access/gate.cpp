#include "net/access/gate.h"

#include <utility>

#include "net/clock.h"

namespace brachy::net {
namespace {

constexpr std::size_t kMaxAddresses = 1024;  // whose wrong tokens are remembered

ErrorMessage fatal(ErrorCode code, std::string text) {
  return {code, true, 0, 0, std::move(text)};
}

}  // namespace

Gate::Place::Place(std::shared_ptr<Counts> counts, std::string address, std::optional<ErrorMessage> refusal)
    : counts_(std::move(counts)), address_(std::move(address)), refusal_(std::move(refusal)) {
  if (!counts_) return;
  if (refusal_) {
    ++counts_->told;
    return;
  }
  ++counts_->places;
  ++counts_->places_of[address_];
}

Gate::Place::~Place() {
  if (!counts_) return;
  if (refusal_) {
    --counts_->told;
    return;
  }
  --counts_->places;
  const auto of_address = counts_->places_of.find(address_);
  if (--of_address->second == 0) counts_->places_of.erase(of_address);
}

Gate::Gate(std::uint32_t max_places, std::uint32_t max_of_address, TokenGrants tokens)
    : max_places_(max_places), max_of_address_(max_of_address), tokens_(std::move(tokens)) {}

std::shared_ptr<const Gate::Place> Gate::enter(const std::string& address, std::int64_t now_ns) {
  auto refused = refusal_at_entry(address, now_ns);
  refused_ += refused ? 1 : 0;
  if (refused && counts_->told >= kMaxTold) return nullptr;
  return std::make_shared<const Place>(counts_, address, std::move(refused));
}

std::shared_ptr<const Gate::Place> Gate::own_place() {
  return std::make_shared<const Place>(nullptr, "", std::nullopt);
}

std::optional<ErrorMessage> Gate::refusal_at_entry(const std::string& address, std::int64_t now_ns) {
  if (is_shut_out(address, now_ns))
    return fatal(ErrorCode::kUnauthorised,
                 "too many wrong tokens came from " + address + ": try again in a minute");
  if (counts_->places >= max_places_)
    return fatal(ErrorCode::kBusy, "all " + std::to_string(max_places_) + " client places are taken");
  const auto of_address = counts_->places_of.find(address);
  if (of_address != counts_->places_of.end() && of_address->second >= max_of_address_)
    return fatal(ErrorCode::kBusy, "all " + std::to_string(max_of_address_) +
                                       " client places of one address are taken by " + address);
  return std::nullopt;
}

std::optional<ErrorMessage> Gate::refusal(const std::string& address, const std::optional<Token>& shown,
                                          Role role, std::int64_t now_ns) {
  if (tokens_.is_empty()) return std::nullopt;
  if (!shown)
    return fatal(
        ErrorCode::kUnauthorised,
        "this daemon wants a token: give --token-file FILE, in a browser #token=… behind the address");
  switch (tokens_.ask(*shown, role)) {
    case TokenGrants::Answer::kGranted:
      return std::nullopt;
    case TokenGrants::Answer::kOtherRole:
      return fatal(ErrorCode::kUnauthorised, "the token is not for this role");
    case TokenGrants::Answer::kUnknown:
      break;
  }
  note_wrong_token(address, now_ns);
  return fatal(ErrorCode::kUnauthorised, "the token is none of this daemon's");
}

void Gate::note_wrong_token(const std::string& address, std::int64_t now_ns) {
  ++wrong_tokens_;
  const auto is_over = [&](const auto& entry) {
    return now_ns - entry.second.back() >= in_ns(kWrongTokensWindow);
  };
  if (wrong_at_ns_.size() >= kMaxAddresses) std::erase_if(wrong_at_ns_, is_over);
  if (wrong_at_ns_.size() >= kMaxAddresses) wrong_at_ns_.erase(wrong_at_ns_.begin());
  std::vector<std::int64_t>& times = wrong_at_ns_[address];
  if (times.size() == kMaxWrongTokens) times.erase(times.begin());
  times.push_back(now_ns);
}

bool Gate::is_shut_out(const std::string& address, std::int64_t now_ns) const {
  const auto wrong = wrong_at_ns_.find(address);
  return wrong != wrong_at_ns_.end() && wrong->second.size() == kMaxWrongTokens &&
         now_ns - wrong->second.front() < in_ns(kWrongTokensWindow);
}

}  // namespace brachy::net
