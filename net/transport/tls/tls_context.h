#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace boost::asio::ssl {
class context;
}

namespace brachy::net {

/// Keys, certificates and rules that the connections of one end share. OpenSSL's defaults, save: TLS 1.2 at least, no
/// compression, no renegotiation, and every connection has a handshake of its own (no tickets).
using TlsContext = std::shared_ptr<boost::asio::ssl::context>;

/// A server's PEM files; each is read once.
struct TlsServerFiles {
  std::filesystem::path certificate;  ///< and those between it and its CA
  std::filesystem::path key;          ///< readable by its owner alone: mode 0600
  std::filesystem::path client_ca;    ///< empty: no certificate is asked of clients
};

/// Throws UserError that names file and fix: missing, no PEM, a key that others may read, is encrypted or belongs to
/// another certificate. `warn` gets a line where the certificate is out of date.
TlsContext make_server_context(const TlsServerFiles& files,
                               const std::function<void(const std::string&)>& warn);

/// A client's PEM files; all may be empty.
struct TlsClientFiles {
  std::filesystem::path ca;                ///< or the server's own certificate; empty: the system's CAs
  std::filesystem::path certificate, key;  ///< required by a server with tls_client_ca; both or neither
};

/// Throws UserError, as above.
TlsContext make_client_context(const TlsClientFiles& files);

}  // namespace brachy::net
