#pragma once

#include <boost/asio/ip/address.hpp>
#include <optional>
#include <string_view>

namespace brachy::net {

/// Why a request must be refused, as a literal text; "" where it may be served. Pure.
///
/// `host` is the Host header, which must name a loopback address, "localhost" or `bound`, the address that the
/// connection came in on: a page of another site that has its own name resolved to 127.0.0.1 (DNS rebinding) sends
/// that name. Its port is not checked: through a tunnel (ssh -L 8080:127.0.0.1:PORT) it is the tunnel's. Over TLS any
/// name is accepted: the browser has checked it against our certificate.
///
/// `origin` is the Origin header, which browsers send with WebSocket upgrades and which pages cannot forge: host and
/// port must be those of `host`, so that only a page loaded from this server can connect; over TLS it must be https,
/// since a page of http may have been modified on the way. nullopt: none, as from programs.
std::string_view refusal_of_origin(std::string_view host, std::optional<std::string_view> origin,
                                   const boost::asio::ip::address& bound, bool is_tls);

}  // namespace brachy::net
