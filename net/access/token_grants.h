#pragma once

#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "net/wire/messages.h"

namespace brachy::net {

/// The roles that each token grants. With no tokens configured, every client is granted every role.
class TokenGrants {
 public:
  void add(const Token& token, std::initializer_list<Role> roles);

  bool is_empty() const { return grants_.empty(); }

  enum class Answer { kGranted, kOtherRole, kUnknown };
  /// Whether `shown` grants `role`. Runs in constant time: every token is compared, to its end.
  Answer ask(const Token& shown, Role role) const;

 private:
  struct Grant {
    Token token;
    std::uint32_t roles;  // a bit for each
  };
  std::vector<Grant> grants_;
};

}  // namespace brachy::net
