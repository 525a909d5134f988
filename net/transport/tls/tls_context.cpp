#include "net/transport/tls/tls_context.h"

#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <openssl/x509err.h>
#include <sys/stat.h>

#include <boost/asio/ssl/context.hpp>
#include <cerrno>
#include <cstring>
#include <ctime>

#include "core/base/error.h"

namespace brachy::net {
namespace ssl = boost::asio::ssl;
namespace {

/// A file, and the option or key that names it.
struct NamedFile {
  const char* name;
  const std::filesystem::path& path;
  std::string shown() const { return std::string(name) + " '" + path.string() + "'"; }
};

struct ::stat status_of(const NamedFile& file) {
  struct ::stat status {};
  if (::stat(file.path.c_str(), &status) != 0)
    throw UserError(file.shown() + ": " + std::strerror(errno) + "; give a PEM file");
  if (!S_ISREG(status.st_mode)) throw UserError(file.shown() + " is not a file: give a PEM file");
  return status;
}

[[noreturn]] void refuse_content(const NamedFile& file, const char* what,
                                 const boost::system::error_code& error) {
  throw UserError(file.shown() + " cannot be read as " + what + " in PEM: " + error.message());
}

void load_certificate(ssl::context& context, const NamedFile& file) {
  status_of(file);
  boost::system::error_code error;
  context.use_certificate_chain_file(file.path.string(), error);
  if (error) refuse_content(file, "a certificate", error);
}

void load_key(ssl::context& context, const NamedFile& file, const NamedFile& certificate) {
  constexpr mode_t kOthers = S_IRWXG | S_IRWXO;
  if ((status_of(file).st_mode & kOthers) != 0) {
    throw UserError(file.shown() + " may be read or changed by others: chmod 600 " + file.path.string() +
                    ", and if they are not to be trusted, make a new one");
  }
  bool is_encrypted = false;
  context.set_password_callback([&](std::size_t, ssl::context::password_purpose) {
    is_encrypted = true;  // no prompt: a daemon has no terminal
    return std::string();
  });
  boost::system::error_code error;
  context.use_private_key_file(file.path.string(), ssl::context::pem, error);
  context.set_password_callback(
      [](std::size_t, ssl::context::password_purpose) { return std::string(); });  // without the reference
  if (is_encrypted) {
    throw UserError(file.shown() + " is encrypted: remove the passphrase with openssl pkey -in " +
                    file.path.string() + " -out KEY.pem, mode 0600");
  }
  const bool is_of_another =
      ERR_GET_LIB(static_cast<unsigned long>(error.value())) == ERR_LIB_X509 &&
      ERR_GET_REASON(static_cast<unsigned long>(error.value())) == X509_R_KEY_VALUES_MISMATCH;
  if (error && !is_of_another) refuse_content(file, "a private key", error);
  if (error || SSL_CTX_check_private_key(context.native_handle()) != 1) {
    throw UserError(file.shown() + " does not belong to " + certificate.shown() +
                    ": give the key that the certificate was made with");
  }
}

void trust(ssl::context& context, const NamedFile& file) {
  status_of(file);
  boost::system::error_code error;
  context.load_verify_file(file.path.string(), error);
  if (error) refuse_content(file, "certificates", error);
}

std::string day(const ASN1_TIME* time) {
  std::tm tm{};
  char text[16] = "?";
  if (ASN1_TIME_to_tm(time, &tm) == 1) std::strftime(text, sizeof text, "%Y-%m-%d", &tm);
  return text;
}

void warn_of_dates(ssl::context& context, const NamedFile& file,
                   const std::function<void(const std::string&)>& warn) {
  const X509* certificate = SSL_CTX_get0_certificate(context.native_handle());
  const ASN1_TIME* end = X509_get0_notAfter(certificate);
  const ASN1_TIME* begin = X509_get0_notBefore(certificate);
  if (X509_cmp_current_time(end) < 0)
    warn(file.shown() + " expired on " + day(end) + ": clients will refuse it; make a new one");
  else if (X509_cmp_current_time(begin) > 0)
    warn(file.shown() + " is valid from " + day(begin) + ": clients will refuse it until then");
}

TlsContext make_context(ssl::context::method method) {
  auto context = std::make_shared<ssl::context>(method);
  SSL_CTX_set_min_proto_version(context->native_handle(), TLS1_2_VERSION);
  SSL_CTX_set_options(context->native_handle(), SSL_OP_NO_COMPRESSION | SSL_OP_NO_RENEGOTIATION);
  // Of TLS 1.2 too only what TLS 1.3 has: authenticated encryption, and keys that a stolen one does not open later.
  if (SSL_CTX_set_cipher_list(context->native_handle(), "ECDHE+AESGCM:ECDHE+CHACHA20") != 1)
    throw UserError(
        "this system's OpenSSL has no cipher suite with forward secrecy: install Debian's libssl3");
  return context;
}

}  // namespace

TlsContext make_server_context(const TlsServerFiles& files,
                               const std::function<void(const std::string&)>& warn) {
  const NamedFile certificate{"tls_certificate", files.certificate}, key{"tls_key", files.key},
      client_ca{"tls_client_ca", files.client_ca};
  TlsContext context = make_context(ssl::context::tls_server);
  load_certificate(*context, certificate);
  load_key(*context, key, certificate);
  warn_of_dates(*context, certificate, warn);
  SSL_CTX* handle = context->native_handle();
  SSL_CTX_set_options(handle, SSL_OP_NO_TICKET);
  SSL_CTX_set_num_tickets(handle, 0);
  SSL_CTX_set_session_cache_mode(handle, SSL_SESS_CACHE_OFF);
  if (files.client_ca.empty()) return context;
  trust(*context, client_ca);
  SSL_CTX_set_client_CA_list(handle, SSL_load_client_CA_file(files.client_ca.c_str()));  // sent to clients
  context->set_verify_mode(ssl::verify_peer | ssl::verify_fail_if_no_peer_cert);
  return context;
}

TlsContext make_client_context(const TlsClientFiles& files) {
  const NamedFile certificate{"--tls-certificate", files.certificate}, key{"--tls-key", files.key},
      ca{"--tls-ca", files.ca};
  if (files.certificate.empty() != files.key.empty())
    throw UserError("--tls-certificate and --tls-key belong together: give both or neither");
  TlsContext context = make_context(ssl::context::tls_client);
  context->set_verify_mode(ssl::verify_peer);
  if (files.ca.empty()) {
    context->set_default_verify_paths();
  } else {
    trust(*context, ca);
    // A trusted certificate needs no issuer: a server's own may be given.
    X509_VERIFY_PARAM_set_flags(SSL_CTX_get0_param(context->native_handle()), X509_V_FLAG_PARTIAL_CHAIN);
  }
  if (files.certificate.empty()) return context;
  load_certificate(*context, certificate);
  load_key(*context, key, certificate);
  return context;
}

}  // namespace brachy::net
