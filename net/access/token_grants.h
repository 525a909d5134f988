#pragma once

#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "net/wire/messages.h"

namespace brachy::net {

/// Which roles a token gives. Without any token everybody has every role.
class TokenGrants {
 public:
  void add(const Token& token, std::initializer_list<Role> roles);

  bool is_empty() const { return grants_.empty(); }

  enum class Answer { kGranted, kOtherRole, kUnknown };
  /// Whether `shown` gives `role`. It takes the same time whatever is shown: all tokens are compared, to their end.
  Answer ask(const Token& shown, Role role) const;

 private:
  struct Grant {
    Token token;
    std::uint32_t roles;  // a bit for each
  };
  std::vector<Grant> grants_;
};

}  // namespace brachy::net
