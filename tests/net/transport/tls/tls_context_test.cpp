// Invalid certificates and keys are reported when they are read, with the file and the fix.
#include "net/transport/tls/tls_context.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/net/http/http_testing.h"
#include "tests/net/transport/tls/certificates.h"

namespace brachy::net::test {
namespace {

struct TlsContextTest : ::testing::Test {
  std::string refusal(const TlsServerFiles& files) {
    try {
      make_server_context(files, [this](const std::string& line) { warnings.push_back(line); });
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
  static std::string refusal_of_client(const TlsClientFiles& files) {
    try {
      make_client_context(files);
    } catch (const UserError& error) {
      return error.what();
    }
    return "";
  }
  static void expect_parts(const std::string& text, std::initializer_list<std::string> parts) {
    for (const std::string& part : parts)
      EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
  }

  TemporaryFolder folder;
  TestCa ca{folder.path()};
  Identity server = ca.issue("server");
  std::vector<std::string> warnings;
};

TEST_F(TlsContextTest, GoodFilesAreTaken) {
  EXPECT_EQ(refusal({server.certificate, server.key, {}}), "");
  EXPECT_EQ(refusal({server.certificate, server.key, ca.certificate()}), "");
  EXPECT_EQ(refusal_of_client({}), "");
  EXPECT_EQ(refusal_of_client({ca.certificate(), server.certificate, server.key}), "");
  EXPECT_TRUE(warnings.empty());
}

TEST_F(TlsContextTest, AMissingFileIsNamed) {
  const auto none = folder.path() / "none.pem";
  expect_parts(refusal({none, server.key, {}}), {"tls_certificate", none.string(), "No such file"});
  expect_parts(refusal({server.certificate, none, {}}), {"tls_key", none.string(), "No such file"});
  expect_parts(refusal({server.certificate, server.key, none}),
               {"tls_client_ca", none.string(), "No such file"});
  expect_parts(refusal_of_client({none, {}, {}}), {"--tls-ca", none.string(), "No such file"});
  expect_parts(refusal({folder.path(), server.key, {}}), {"tls_certificate", "is not a file"});
}

TEST_F(TlsContextTest, WhatIsNoPemIsNamed) {
  folder.write("text.pem", "hello\n");
  const auto text = folder.path() / "text.pem";
  std::filesystem::permissions(text, std::filesystem::perms::owner_read);
  expect_parts(refusal({text, server.key, {}}), {"tls_certificate", text.string(), "certificate in PEM"});
  expect_parts(refusal({server.certificate, text, {}}), {"tls_key", text.string(), "private key in PEM"});
  expect_parts(refusal({server.certificate, server.key, text}), {"tls_client_ca", text.string(), "in PEM"});
  expect_parts(refusal({server.key, server.key, {}}), {"tls_certificate", "certificate in PEM"});
}

TEST_F(TlsContextTest, TheKeyOfAnotherCertificateIsRefused) {
  const Identity other = ca.issue("other");
  expect_parts(refusal({server.certificate, other.key, {}}),
               {"tls_key", other.key.string(), "does not belong to", server.certificate.string()});
}

TEST_F(TlsContextTest, AKeyThatOthersMayReadIsRefused) {
  using std::filesystem::perms;
  for (const perms others : {perms::group_read, perms::others_read, perms::group_write}) {
    std::filesystem::permissions(server.key, perms::owner_read | perms::owner_write | others);
    expect_parts(refusal({server.certificate, server.key, {}}),
                 {"tls_key", "others", "chmod 600 " + server.key.string()});
  }
  std::filesystem::permissions(server.key, perms::owner_read);
  EXPECT_EQ(refusal({server.certificate, server.key, {}}), "");
}

TEST_F(TlsContextTest, AnEncryptedKeyIsRefusedAndNobodyIsAsked) {
  const Identity encrypted = ca.issue_encrypted("encrypted");
  expect_parts(refusal({encrypted.certificate, encrypted.key, {}}), {"tls_key", "encrypted", "openssl pkey"});
}

TEST_F(TlsContextTest, ACertificateOutOfDateIsServedWithAWarning) {
  CertificateText text;
  text.ends_s = -60;
  const Identity ended = ca.issue("ended", text);
  EXPECT_EQ(refusal({ended.certificate, ended.key, {}}), "");
  ASSERT_EQ(warnings.size(), 1u);
  expect_parts(warnings[0], {ended.certificate.string(), "expired on 20"});
  text.begins_s = 3600;
  text.ends_s = 7200;
  const Identity future = ca.issue("future", text);
  EXPECT_EQ(refusal({future.certificate, future.key, {}}), "");
  ASSERT_EQ(warnings.size(), 2u);
  expect_parts(warnings[1], {future.certificate.string(), "is valid from 20"});
}

TEST_F(TlsContextTest, AClientsCertificateComesWithItsKey) {
  expect_parts(refusal_of_client({{}, server.certificate, {}}), {"--tls-certificate", "--tls-key", "both"});
}

}  // namespace
}  // namespace brachy::net::test
