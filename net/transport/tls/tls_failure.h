#pragma once

#include <openssl/ssl.h>

#include <boost/system/error_code.hpp>
#include <string>

namespace brachy::net {

// The reason why TLS with a peer failed, as text for users.

/// At the server, for its log.
std::string failure_with_client(const boost::system::error_code& error, const SSL* tls);

/// At the client: with the fix, in the tools' options.
std::string failure_with_server(const boost::system::error_code& error, const SSL* tls);

}  // namespace brachy::net
