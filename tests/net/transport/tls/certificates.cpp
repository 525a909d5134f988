#include "tests/net/transport/tls/certificates.h"

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <cstdio>
#include <stdexcept>
#include <utility>

namespace brachy::net::test {
namespace {

void check(bool condition) {
  if (!condition) throw std::runtime_error("libcrypto makes no certificate");
}

void add_extension(X509* certificate, X509* issuer, int id, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, id, value.c_str());
  check(extension != nullptr && X509_add_ext(certificate, extension, -1) == 1);
  X509_EXTENSION_free(extension);
}

X509_NAME* name_of(const std::string& common_name) {
  X509_NAME* name = X509_NAME_new();
  const auto* text = reinterpret_cast<const unsigned char*>(common_name.c_str());
  check(X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8, text, -1, -1, 0) == 1);
  return name;
}

}  // namespace

TestCa::TestCa(std::filesystem::path folder, const std::string& name)
    : folder_(std::move(folder)), name_(name), key_(EVP_EC_gen("P-256")) {
  check(key_ != nullptr);
  own_ = sign(name, {name, "", -3600, 86'400}, key_.get(), true);
}

Identity TestCa::issue(const std::string& file, const CertificateText& text) const {
  const Key key(EVP_EC_gen("P-256"));
  check(key != nullptr);
  return sign(file, text, key.get(), false);
}

Identity TestCa::issue_encrypted(const std::string& file) const {
  const Key key(EVP_EC_gen("P-256"));
  check(key != nullptr);
  const Identity identity = sign(file, {}, key.get(), false);
  std::FILE* out = std::fopen(identity.key.c_str(), "w");
  char password[] = "secret";
  check(out != nullptr &&
        PEM_write_PKCS8PrivateKey(out, key.get(), EVP_aes_128_cbc(), password, 6, nullptr, nullptr) == 1);
  std::fclose(out);
  return identity;
}

Identity TestCa::sign(const std::string& file, const CertificateText& text, EVP_PKEY* key, bool is_ca) const {
  X509* certificate = X509_new();
  X509_NAME *subject = name_of(text.name), *issuer = name_of(name_);
  static long serial = 0;
  X509_set_version(certificate, X509_VERSION_3);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate), ++serial);
  X509_gmtime_adj(X509_getm_notBefore(certificate), text.begins_s);
  X509_gmtime_adj(X509_getm_notAfter(certificate), text.ends_s);
  X509_set_subject_name(certificate, subject);
  X509_set_issuer_name(certificate, issuer);
  X509_set_pubkey(certificate, key);
  add_extension(certificate, certificate, NID_basic_constraints, is_ca ? "critical,CA:TRUE" : "CA:FALSE");
  if (!text.holds.empty()) add_extension(certificate, certificate, NID_subject_alt_name, text.holds);
  check(X509_sign(certificate, key_.get(), EVP_sha256()) > 0);

  const Identity identity{folder_ / (file + ".pem"), folder_ / (file + ".key")};
  std::FILE* out = std::fopen(identity.certificate.c_str(), "w");
  check(out != nullptr && PEM_write_X509(out, certificate) == 1);
  std::fclose(out);
  out = std::fopen(identity.key.c_str(), "w");
  check(out != nullptr && PEM_write_PrivateKey(out, key, nullptr, nullptr, 0, nullptr, nullptr) == 1);
  std::fclose(out);
  using std::filesystem::perms;
  std::filesystem::permissions(identity.key, perms::owner_read | perms::owner_write);
  X509_NAME_free(subject);
  X509_NAME_free(issuer);
  X509_free(certificate);
  return identity;
}

}  // namespace brachy::net::test
