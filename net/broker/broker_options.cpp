#include "net/broker/broker_options.h"

#include <algorithm>
#include <cctype>

#include "core/base/error.h"

namespace brachy::net {
namespace {

constexpr std::size_t kMaxSessionBytes = 64;
constexpr std::string_view kSchemes[] = {"nats://", "tls://"};

bool is_name_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_';
}

/// Length of the URL's scheme; 0: not a scheme of NATS.
std::size_t scheme_bytes(const std::string& url) {
  for (const std::string_view scheme : kSchemes)
    if (url.starts_with(scheme)) return scheme.size();
  return 0;
}

}  // namespace

void check_broker_options(const BrokerOptions& options, const std::string& source) {
  const std::size_t scheme = scheme_bytes(options.url);
  const bool is_printable =
      std::ranges::all_of(options.url, [](unsigned char c) { return c > ' ' && c < 0x7F && c != ','; });
  if (scheme == 0 || options.url.size() == scheme || !is_printable)
    throw UserError(source +
                    " is not the address of a broker: give nats://HOST:4222, with TLS tls://HOST:4222");
  if (options.session.empty() || options.session.size() > kMaxSessionBytes ||
      !std::ranges::all_of(options.session, is_name_character))
    throw UserError("the session's name '" + options.session +
                    "' must be 1 to 64 letters, digits, _ or -: it is a part of subjects");
  if (options.tls_certificate.empty() != options.tls_key.empty())
    throw UserError(source + ": a broker's TLS certificate and its key must be given together");
  if (nats_version().empty())
    throw UserError(source + " is given, but this program was built without NATS: install libnats-dev (" +
                    "scripts/setup.sh --broker) and build it again");
}

std::string shown_url(const BrokerOptions& options) {
  const std::size_t scheme = scheme_bytes(options.url);
  const std::size_t at = options.url.rfind('@');
  if (at == std::string::npos || at < scheme) return options.url;
  return options.url.substr(0, scheme) + options.url.substr(at + 1);
}

}  // namespace brachy::net
