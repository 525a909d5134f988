#include "net/access/token_grants.h"

#include <openssl/crypto.h>

namespace brachy::net {
namespace {

std::uint32_t bit(Role role) {
  return 1u << static_cast<unsigned>(role);
}

}  // namespace

void TokenGrants::add(const Token& token, std::initializer_list<Role> roles) {
  Grant& grant = grants_.emplace_back(Grant{token, 0});
  for (const Role role : roles) grant.roles |= bit(role);
}

TokenGrants::Answer TokenGrants::ask(const Token& shown, Role role) const {
  std::uint32_t known = 0, roles = 0;
  for (const Grant& grant : grants_) {
    const auto differs =
        static_cast<std::uint32_t>(CRYPTO_memcmp(grant.token.data(), shown.data(), shown.size()));
    const std::uint32_t is_same = 1u ^ ((differs | (0u - differs)) >> 31);  // no branch
    known |= is_same;
    roles |= grant.roles & (0u - is_same);
  }
  if ((roles & bit(role)) != 0) return Answer::kGranted;
  return known != 0 ? Answer::kOtherRole : Answer::kUnknown;
}

}  // namespace brachy::net
