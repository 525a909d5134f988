#include "net/transport/tls/tls_failure.h"

#include <openssl/err.h>
#include <openssl/x509.h>

#include <boost/asio/error.hpp>
#include <boost/asio/ssl/error.hpp>

namespace brachy::net {
namespace asio = boost::asio;
namespace {

/// OpenSSL's reason; 0 where the error is not OpenSSL's.
int reason_of(const boost::system::error_code& error) {
  if (error.category() != asio::error::get_ssl_category()) return 0;
  return ERR_GET_REASON(static_cast<unsigned long>(error.value()));
}

bool has_left(const boost::system::error_code& error) {
  return error == asio::error::eof || error == asio::ssl::error::stream_truncated ||
         error == asio::error::connection_reset || error == asio::error::broken_pipe;
}

std::string verdict(const SSL* tls) {
  return X509_verify_cert_error_string(SSL_get_verify_result(tls));
}

std::string refused_certificate(const SSL* tls) {
  switch (SSL_get_verify_result(tls)) {
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return "the server's certificate is for another name: connect by one that it holds (openssl x509 "
             "-noout "
             "-ext subjectAltName -in FILE shows them)";
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return "the server's certificate has ended: make a new one";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return "the server's certificate is not valid yet: look at both clocks";
    default:
      return "the server's certificate is not signed by a trusted authority (" + verdict(tls) +
             "): give its CA, or itself, by --tls-ca";
  }
}

}  // namespace

std::string failure_with_client(const boost::system::error_code& error, const SSL* tls) {
  if (has_left(error)) return "it left during the TLS handshake";
  switch (reason_of(error)) {
    case SSL_R_UNSUPPORTED_PROTOCOL:
    case SSL_R_VERSION_TOO_LOW:
      return "it speaks no TLS 1.2 or later";
    case SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE:
      return "it shows no certificate, and tls_client_ca asks for one";
    case SSL_R_CERTIFICATE_VERIFY_FAILED:
      return "its certificate is refused: " + verdict(tls);
    case SSL_R_TLSV1_ALERT_UNKNOWN_CA:
    case SSL_R_SSLV3_ALERT_BAD_CERTIFICATE:
    case SSL_R_SSLV3_ALERT_CERTIFICATE_UNKNOWN:
    case SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED:
      return "it refuses our certificate (" + error.message() + ")";
    default:
      return "TLS: " + error.message();
  }
}

std::string failure_with_server(const boost::system::error_code& error, const SSL* tls) {
  if (has_left(error)) return "the server closed during the TLS handshake; its log may say why";
  switch (reason_of(error)) {
    case SSL_R_WRONG_VERSION_NUMBER:
    case SSL_R_HTTP_REQUEST:
      return "this server speaks no TLS: leave out the options --tls…";
    case SSL_R_TLSV1_ALERT_PROTOCOL_VERSION:
    case SSL_R_UNSUPPORTED_PROTOCOL:
      return "the server speaks no TLS 1.2 or later";
    case SSL_R_CERTIFICATE_VERIFY_FAILED:
      return refused_certificate(tls);
    case SSL_R_TLSV13_ALERT_CERTIFICATE_REQUIRED:
    case SSL_R_SSLV3_ALERT_HANDSHAKE_FAILURE:  // so TLS 1.2 says it
      return "the server asks for a certificate: give one that its tls_client_ca has signed, by "
             "--tls-certificate and --tls-key";
    case SSL_R_TLSV1_ALERT_UNKNOWN_CA:
    case SSL_R_SSLV3_ALERT_BAD_CERTIFICATE:
    case SSL_R_SSLV3_ALERT_CERTIFICATE_UNKNOWN:
    case SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED:
      return "the server refuses our certificate (" + error.message() +
             "): give one that its tls_client_ca has signed, by --tls-certificate and --tls-key";
    default:
      return "TLS: " + error.message();
  }
}

}  // namespace brachy::net
