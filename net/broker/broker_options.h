#pragma once

#include <string>
#include <string_view>

namespace brachy::net {

/// Where a session is published and read (net/NATS.md). Checked by check_broker_options.
struct BrokerOptions {
  std::string url;  ///< nats://[USER:PASSWORD@ or TOKEN@]HOST[:PORT], or tls://…
  std::string session = "default";
  std::string tls_ca;  ///< PEM; with it, or with tls://, TLS is required; empty: the system's
  std::string tls_certificate,
      tls_key;  ///< PEM, for a broker that requires a client certificate; empty: none is sent
  std::string client_name = "brachy";  ///< shown by the broker's monitoring

  std::string stream_subject() const { return "brachy." + session + ".stream"; }
  std::string ask_subject() const { return "brachy." + session + ".ask"; }
};

/// Throws UserError: the URL or the session's name is invalid, or this program was built without libnats. `source`
/// begins the message: the key or option that was given ("broker.url", "--nats").
void check_broker_options(const BrokerOptions& options, const std::string& source);

/// The URL without user, password and token: for logs.
std::string shown_url(const BrokerOptions& options);

/// libnats' version; "" where this program was built without.
std::string_view nats_version();

}  // namespace brachy::net
