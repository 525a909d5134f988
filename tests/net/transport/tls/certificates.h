#pragma once

#include <openssl/x509.h>

#include <filesystem>
#include <memory>
#include <string>

namespace brachy::net::test {

/// PEM files of one certificate and its key.
struct Identity {
  std::filesystem::path certificate, key;
};

/// The content of a certificate.
struct CertificateText {
  std::string name = "test";
  std::string holds = "DNS:localhost,IP:127.0.0.1";  ///< subjectAltName
  long begins_s = -3600, ends_s = 86'400;            ///< from now
};

/// A certificate authority; its files, and those of what it signs, are written into `folder`.
class TestCa {
 public:
  explicit TestCa(std::filesystem::path folder, const std::string& name = "ca");

  /// A new key, and a certificate for it. The names of both files begin with `file`.
  Identity issue(const std::string& file, const CertificateText& text = {}) const;
  /// The key's file is encrypted.
  Identity issue_encrypted(const std::string& file) const;
  const std::filesystem::path& certificate() const { return own_.certificate; }

 private:
  struct FreeKey {
    void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  };
  using Key = std::unique_ptr<EVP_PKEY, FreeKey>;

  Identity sign(const std::string& file, const CertificateText& text, EVP_PKEY* key, bool is_ca) const;

  std::filesystem::path folder_;
  std::string name_;
  Key key_;
  Identity own_;
};

}  // namespace brachy::net::test
